// Texts that commands read as a whole: what has no end, and what is larger than such a text may be, is refused at once.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

struct Case {
  std::string name, file;              // the file that is read, in a folder of its own
  std::vector<std::string> arguments;  // FILE: it; MESH: a mesh; RUN: its folder; VOLUME: a volume
  uint64_t limit = 0;                  // bytes; 0: it is read in pieces
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class TextInput : public ::testing::TestWithParam<Case> {
 protected:
  // Of one that lies there as `lay` does it.
  void expect_refusal(const std::string& what, const std::function<void(const std::string& path)>& lay,
                      const std::string& said) {
    const Case& c = GetParam();
    TemporaryFolder folder;
    const fs::path run = folder / "run";
    fs::create_directories(run);
    std::ofstream(run / "session.toml") << "[scene]\nkind = \"mesh\"\nfile = \"a.ply\"\n"
                                           "[[process]]\nrole = \"viewer\"\nname = \"viewer-1\"\n"
                                           "width = \"64\"\nheight = \"40\"\nfov_deg = \"90\"\n";
    std::ofstream(run / "summary.json") << "{}";
    const std::string path = run / c.file;
    fs::remove(path);
    lay(path);
    write_terrain(folder / "mesh.ply", 4);
    std::ofstream(folder / "volume.raw") << std::string(4096, 'x');
    std::vector<std::string> arguments;
    for (std::string a : c.arguments) {
      if (a == "FILE") a = path;
      if (a == "MESH") a = folder / "mesh.ply";
      if (a == "VOLUME") a = folder / "volume.raw";
      if (a == "RUN") a = run;
      arguments.push_back(std::move(a));
    }
    if (arguments[0] == "run") arguments.insert(arguments.end(), {"--out", folder / "out"});
    Program program("telesplat", arguments, folder / "telesplat");
    EXPECT_EQ(program.wait(10), 2) << what << ": " << program.err();
    const std::string err = program.complaint();
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
    EXPECT_NE(err.find(path), std::string::npos) << err;
    EXPECT_NE(err.find(said), std::string::npos) << err;
  }
};

TEST_P(TextInput, WithoutAnEndIsRefused) {
  expect_refusal(
      "a pipe", [](const std::string& path) { ASSERT_EQ(mkfifo(path.c_str(), 0600), 0); }, "is not a regular file");
  expect_refusal(
      "zeros", [](const std::string& path) { fs::create_symlink("/dev/zero", path); }, "is not a regular file");
}

TEST_P(TextInput, BeyondTheLimitIsRefused) {
  const uint64_t limit = GetParam().limit;
  expect_refusal(
      "a large one",
      [&](const std::string& path) {
        std::ofstream(path) << '\n';
        fs::resize_file(path, limit + 1);
      },
      "has " + std::to_string(limit + 1) + " bytes, limit " + std::to_string(limit));
}

constexpr uint64_t kMiB = 1 << 20;
const Case kCases[] = {
    {"Scene", "scene.toml", {"run", "FILE"}, kMiB},
    {"Trajectory", "head.csv", {"run", "MESH", "--trajectory", "FILE"}, 4096 * kMiB},
    {"Wall", "wall.toml", {"run", "MESH", "--wall", "FILE"}, kMiB},
    {"Barrier", "panel.toml", {"run", "MESH", "--stereo", "autostereo", "--barrier", "FILE"}, kMiB},
    {"TransferFunction", "tf.json", {"run", "VOLUME", "--raw", "16x16x16:u8", "--tf", "FILE"}, 4 * kMiB},
    {"ColourMap", "map.json", {"run", "MESH", "--colour-by", "x", "--colour-map", "FILE"}, 4 * kMiB},
    {"Session", "session.toml", {"compare", "RUN"}, 64 * kMiB},
    {"Frames", "frames.csv", {"compare", "RUN"}, 4096 * kMiB},
    {"Summary", "summary.json", {"inspect", "RUN"}, 64 * kMiB},
};
INSTANTIATE_TEST_SUITE_P(Cases, TextInput, ::testing::ValuesIn(kCases),
                         [](const auto& info) { return info.param.name; });

// Nothing but what its own folder holds is written: a report of a stranger's run, too.
TEST(RunFolders, ReportsAreNotWrittenThroughLinks) {
  TemporaryFolder folder;
  const fs::path run = folder / "run";
  fs::create_directories(run);
  std::ofstream(run / "summary.json") << "{}";
  std::ofstream(run / "frames.csv") << "viewer,t_s\nviewer-1,0\n";
  std::ofstream(folder / "precious") << "precious";
  for (const char* name : {"report.html", "report.html.part"}) fs::create_symlink(folder / "precious", run / name);
  Program report("telesplat", {"report", run}, folder / "telesplat");
  EXPECT_EQ(report.wait(60), 0) << report.err();
  EXPECT_EQ(fs::file_size(folder / "precious"), 8u);
  EXPECT_FALSE(fs::is_symlink(run / "report.html"));
  EXPECT_TRUE(read_text(run / "report.html").starts_with("<!DOCTYPE html>"));
}

}  // namespace
}  // namespace telesplat::test
