// Wrong usage is refused by the program that was called: exit code 2, one line. What commands of telesplat refuse is
// tested without processes (tests/integration/commands).
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

TEST(Usage, IsRefusedWithOneLine) {
  TemporaryFolder folder;
  Program program("telesplat-viewer", {"--sise", "3x3"}, folder / "program");
  EXPECT_EQ(program.wait(30), 2);
  EXPECT_EQ(program.err(), "telesplat-viewer: --sise: no such flag of telesplat-viewer; did you mean --size?\n");
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
