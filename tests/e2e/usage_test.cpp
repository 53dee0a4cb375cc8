// Wrong usage is refused by the program that was called, before it starts another: exit code 2, one line that names
// flag, value and limit.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

struct Case {
  std::string name;
  std::vector<std::string> arguments;  // the program first
  std::string line;                    // all of what it says
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class Usage : public ::testing::TestWithParam<Case> {};

TEST_P(Usage, IsRefusedWithOneLine) {
  const Case& c = GetParam();
  TemporaryFolder folder;
  write_terrain(folder / "terrain.ply", 4);
  std::vector<std::string> arguments(c.arguments.begin() + 1, c.arguments.end());
  std::replace(arguments.begin(), arguments.end(), std::string("MESH"), folder / "terrain.ply");
  if (arguments.size() > 1 && arguments[0] == "run" && arguments[1].ends_with("terrain.ply")) {
    arguments.insert(arguments.begin() + 2, {"--out", folder / "out", "--no-cache"});
    if (std::find(arguments.begin(), arguments.end(), "--duration") == arguments.end())
      arguments.insert(arguments.begin() + 2, {"--duration", "1"});
  }
  Program program(c.arguments.front(), arguments, folder / "program");
  EXPECT_EQ(program.wait(30), 2) << program.err();
  EXPECT_EQ(program.err(), c.line + "\n");
  EXPECT_FALSE(fs::exists(folder / "out")) << "something was started";
}

const Case kCases[] = {
    {"WrongFlag",
     {"telesplat", "run", "MESH", "--durationn", "3"},
     "telesplat: --durationn: no such flag of telesplat run; did you mean --duration?"},
    {"WrongFlagOfAService",
     {"telesplat-viewer", "--sise", "3x3"},
     "telesplat-viewer: --sise: no such flag of telesplat-viewer; did you mean --size?"},
    {"OrdersMaster",
     {"telesplat", "ctl", "status", "--master", "foo"},
     "telesplat: --master foo: is no address such as tcp://127.0.0.1:7700"},
};

INSTANTIATE_TEST_SUITE_P(All, Usage, ::testing::ValuesIn(kCases), [](const auto& info) { return info.param.name; });

TEST(UsageOfHelp, HelpNamesACommandOrOneOfItsOwn) {
  TemporaryFolder folder;
  const auto said = [&](const std::vector<std::string>& arguments, int code = 0) {
    Program program("telesplat", arguments, folder / "program");
    EXPECT_EQ(program.wait(30), code) << program.err();
    return code == 0 ? program.out() : program.err();
  };
  EXPECT_EQ(said({"help"}), said({"--help"}));
  EXPECT_EQ(said({"help", "run"}), said({"run", "--help"}));
  EXPECT_EQ(said({"help", "run", "all"}), said({"run", "--help", "all"}));
  EXPECT_EQ(said({"help", "ctl", "clip"}), said({"ctl", "clip", "--help"}));
  EXPECT_NE(said({"--help"}).find("telesplat help COMMAND"), std::string::npos) << "it is told";
  EXPECT_EQ(said({"help", "rnu"}, 2), "telesplat: rnu: no such command of telesplat; did you mean run?\n");
}

// A viewer without windows and headsets names the program that has them, and what builds it.
TEST(UsageOfDisplays, TheirProgramIsNamedWhereItIsMissing) {
  TemporaryFolder folder;
  const std::string copy = folder / "telesplat-viewer";
  fs::copy_file(std::string(TELESPLAT_BIN) + "/telesplat-viewer", copy);
  for (const std::string flag : {"--window", "--xr"}) {
    Program program(copy, {flag, "--master", "tcp://127.0.0.1:7"}, folder / "program");
    EXPECT_EQ(program.wait(30), 2);
    const std::string line = "telesplat: windows and headsets need telesplat-display, which is not in " +
                             fs::canonical(copy).parent_path().string() +
                             ": cmake --build build/release --target telesplat-display builds it\n";
    EXPECT_EQ(program.err(), line);
  }
}

}  // namespace
}  // namespace telesplat::test
