// Volumes that cannot be shown, and flags that do not fit: exit code 2, one line that names what, nothing left behind.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

struct Wrong {
  std::string name;
  std::string scene;  // "balls.mha", "cut.mha", "balls.raw", "terrain.ply", "folder", "julia" or "none.nrrd"
  std::vector<std::string> arguments;
  std::string named;  // what the line must name
};
void PrintTo(const Wrong& w, std::ostream* out) { *out << w.name; }

class VolumeWrong : public ::testing::TestWithParam<Wrong> {};

TEST_P(VolumeWrong, ExitsWithTwoAndOneLine) {
  const Wrong& w = GetParam();
  TemporaryFolder folder;
  const std::string volume = folder / "balls.mha", out = folder / "out";
  write_volume(volume, 16);
  write_terrain(folder / "terrain.ply", 4);
  fs::create_directory(folder / "folder");
  fs::copy_file(volume, folder / "cut.mha");
  fs::resize_file(folder / "cut.mha", fs::file_size(volume) - 7);
  const std::string mha = read_text(volume);
  std::ofstream(folder / "balls.raw", std::ios::binary) << mha.substr(mha.size() - 16 * 16 * 16);
  std::string lying = mha;
  lying.replace(lying.find("16 16 16"), 8, "16 16 17");
  std::ofstream(folder / "lying.mha", std::ios::binary) << lying;

  std::vector<std::string> arguments{
      "run", w.scene == "julia" ? w.scene : folder / w.scene, "--out", out, "--size", "160x100", "--duration", "1"};
  arguments.insert(arguments.end(), w.arguments.begin(), w.arguments.end());
  Program program("telesplat", arguments, folder / "telesplat");
  EXPECT_EQ(program.wait(60), 2) << program.err();
  const std::string err = program.complaint();
  EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
  EXPECT_TRUE(err.starts_with("telesplat: ")) << err;
  EXPECT_NE(err.find(w.named), std::string::npos) << err;
  EXPECT_FALSE(fs::exists(out)) << "a run folder was left";
}

const Wrong kWrong[] = {
    {"NoSuchFile", "none.nrrd", {}, "none.nrrd: no such file"},
    {"CutOff", "cut.mha", {}, "cut.mha"},
    {"LyingHeader", "lying.mha", {}, "lying.mha"},
    {"EmptyFolder", "folder", {}, "folder"},
    {"RawOfUnknownType", "balls.raw", {"--raw", "16x16x16:uint8"}, "\"uint8\" is no type; types are u8, i8, u16"},
    {"RawWithoutALayout", "balls.raw", {}, "could be --raw 16x16x16:u8"},
    {"LayoutOfWhatTellsIt", "lying.mha", {"--raw", "16x16x18:u8"}, "which tells its layout itself: leave out --raw"},
    {"SeriesOfAFile", "lying.mha", {"--series", "1"}, "--series: "},
    {"RawTooLarge", "balls.raw", {"--raw", "16x16x17:u8"}, "balls.raw"},
    {"RawTooSmall", "balls.raw", {"--raw", "16x16x15:u8"}, "balls.raw"},
    {"RawUnreadable", "balls.raw", {"--raw", "16x16:u8"}, "16x16:u8"},
    {"RawType", "balls.raw", {"--raw", "16x16x16:u7"}, "u7"},
    {"UnknownPreset", "balls.mha", {"--tf", "nonesuch"}, "nonesuch"},
    {"UnreadablePoints", "balls.mha", {"--tf", "0:#000000:0,5"}, "5"},
    {"OpacityBeyondOne", "balls.mha", {"--tf", "0:#000000:2"}, "2"},
    {"NoSuchColourMap", "balls.mha", {"--tf", "none.json"}, "none.json"},
    {"SplatsOfAVolume", "balls.mha", {"--splat", "disc"}, "--splat: "},
    {"SamplerOfAVolume", "balls.mha", {"--sampler", "ray"}, "--sampler: "},
    {"TransferOfAMesh", "terrain.ply", {"--tf", "bone"}, "--tf: "},
    {"PartsOfAMesh", "terrain.ply", {"--data-servers", "2"}, "--data-servers: "},
    {"SeriesOfAJuliaSet", "julia", {"--series-rate", "3"}, "--series-rate: "},
    {"JuliaSetsParameters", "balls.mha", {"--c.x", "0.3"}, "balls.mha"},
    {"WallOfNothing", "balls.mha", {"--wall", "0x1"}, "--wall 0x1"},
    {"WallOfWords", "balls.mha", {"--wall", "wide"}, "--wall wide"},
    {"WallAndViewers", "balls.mha", {"--wall", "2x1", "--viewers", "3"}, "--viewers 3"},
};
INSTANTIATE_TEST_SUITE_P(Cases, VolumeWrong, ::testing::ValuesIn(kWrong),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace telesplat::test
