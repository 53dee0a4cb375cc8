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
  std::string scene;  // "balls.mha" or "cut.mha"
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
  fs::copy_file(volume, folder / "cut.mha");
  fs::resize_file(folder / "cut.mha", fs::file_size(volume) - 7);

  std::vector<std::string> arguments{"run", folder / w.scene, "--out", out, "--size", "160x100", "--duration", "1"};
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
    {"CutOff", "cut.mha", {}, "cut.mha"},
    {"SeriesOfAFile", "balls.mha", {"--series", "1"}, "--series: "},
    {"UnknownPreset", "balls.mha", {"--tf", "nonesuch"}, "nonesuch"},
};
INSTANTIATE_TEST_SUITE_P(Cases, VolumeWrong, ::testing::ValuesIn(kWrong),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace telesplat::test
