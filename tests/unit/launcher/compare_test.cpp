// Run folders and flags that `telesplat compare` refuses before it reads any data.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/options/table.h"
#include "tests/support/files/own_folder.h"
#include "tools/telesplat/compare/subject.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

// A run folder of two frames, made by hand.
struct Refusal {
  std::string name, file, content;  // written over one of its files; content "GONE": the file is removed
  std::string named;                // what the error must name
  std::vector<uint64_t> frames = {};
};
void PrintTo(const Refusal& r, std::ostream* out) { *out << r.name; }

class CompareRefuses : public testing::TestWithParam<Refusal> {};

const std::string kHeader = "viewer,frame,t_s,points_drawn,sequence,px,py,pz,qw,qx,qy,qz\n";
const std::string kViewer = "[[process]]\nrole = \"viewer\"\nname = \"viewer-1\"\nwidth = \"160\"\nheight = \"100\"\n";

TEST_P(CompareRefuses, NamesWhatIsWrong) {
  const Refusal& r = GetParam();
  const std::string folder = tests::own_folder() + r.name, run = folder + "/run", scene = folder + "/terrain.ply";
  fs::create_directories(run);
  std::ofstream(scene) << "ply\n";
  std::ofstream(run + "/session.toml") << "[session]\noctree_depth = 6\n"
                                       << kViewer << "[scene]\nfile = \"" << scene
                                       << "\"\n[display]\nfov = 90\nnear = 0.02\n";
  std::ofstream(run + "/frames.csv") << kHeader
                                     << "viewer-1,0,0.5,5000,3,0,0,1,1,0,0,0\nviewer-1,1,0.6,5000,4,0,0,1,1,0,0,0\n";
  std::ofstream(run + "/points.events") << "TSEVENT2";
  CompareOptions options;
  options.path = run;
  options.frames = r.frames;
  ASSERT_TRUE(find_subject(options).ok()) << "nothing else is wrong";
  if (r.content == "GONE")
    fs::remove(folder + "/" + r.file);
  else
    std::ofstream(folder + "/" + r.file, std::ios::trunc) << r.content;
  const auto subject = find_subject(options);
  ASSERT_FALSE(subject.ok());
  EXPECT_NE(subject.error().text.find(r.named), std::string::npos) << subject.error().text;
}

const Refusal kRefusals[] = {
    {"NoEvents", "run/points.events", "GONE", "points.events"},
    {"NoSession", "run/session.toml", "GONE", "session.toml"},
    {"BrokenSession", "run/session.toml", "[session\n", "session.toml:1"},
    {"NoViewer", "run/session.toml", "[session]\n", "no viewer"},
    {"HugeDisplay", "run/session.toml",
     "[[process]]\nrole = \"viewer\"\nname = \"viewer-1\"\nwidth = \"99999999\"\nheight = \"10\"\n", "99999999"},
    {"NoSceneNamed", "run/session.toml", kViewer, "--scene"},
    {"NoFrames", "run/frames.csv", "GONE", "frames.csv"},
    {"OnlyAHeader", "run/frames.csv", kHeader, "frames.csv"},
    {"NoSequence", "run/frames.csv", "viewer,frame,t_s\nviewer-1,0,0\n", "no column sequence"},
    {"CutLine", "run/frames.csv", kHeader + "viewer-1,0,0.5,5000,3,0,0", "frames.csv:2"},
    {"CutNumber", "run/frames.csv", kHeader + "viewer-1,0,0.5,5000,3,0,0,1,1,0,0,0", "cut off"},
    {"NotANumber", "run/frames.csv", kHeader + "viewer-1,0,0.5,many,3,0,0,1,1,0,0,0\n", "many"},
    {"NaN", "run/frames.csv", kHeader + "viewer-1,0,0.5,5000,3,nan,0,1,1,0,0,0\n", "px"},
    {"NoRotation", "run/frames.csv", kHeader + "viewer-1,0,0.5,5000,3,0,0,1,9,0,0,0\n", "frames.csv:2"},
    {"FarAway", "run/frames.csv", kHeader + "viewer-1,0,0.5,5000,3,1e30,0,1,1,0,0,0\n", "frames.csv:2"},
    {"NothingShown", "run/frames.csv", kHeader + "viewer-1,0,0.5,0,3,0,0,1,1,0,0,0\n", "no frame shows"},
    {"NoSuchFrame", "run/frames.csv", kHeader + "viewer-1,0,0.5,5000,3,0,0,1,1,0,0,0\n", "--frames 1", {0, 1}},
    {"SceneGone", "terrain.ply", "GONE", "--scene"},
};
INSTANTIATE_TEST_SUITE_P(All, CompareRefuses, testing::ValuesIn(kRefusals),
                         [](const auto& info) { return info.param.name; });

TEST(CompareFlags, HaveLimits) {
  CompareOptions options;
  const options::Table rows = table(options);
  for (const auto& [flag, text] : {std::pair{"--kernels", "square,star"},
                                   {"--renderers", "vulkan"},
                                   {"--poses", "0"},
                                   {"--frames", "1,b"},
                                   {"--samples", "0"}})
    EXPECT_FALSE(options::set(*options::find(rows, flag), text).ok()) << flag;
}

}  // namespace
}  // namespace telesplat::launcher
