// Texts that commands read as a whole, and files that they write. The readers have unit tests (text_inputs_test).
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

TEST(SceneFile, WithoutAnEndOrBeyondTheLimitIsRefused) {
  TemporaryFolder folder;
  const std::string pipe = folder / "pipe.toml", zeros = folder / "zeros.toml", large = folder / "large.toml";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  fs::create_symlink("/dev/zero", zeros);
  std::ofstream(large) << '\n';
  fs::resize_file(large, (1 << 20) + 1);
  for (const auto& [path, said] : {std::pair{pipe, "is not a regular file"},
                                   {zeros, "is not a regular file"},
                                   {large, "has 1048577 bytes, limit 1048576"}}) {
    Program program("telesplat", {"run", path, "--out", folder / "out"}, folder / "telesplat");
    EXPECT_EQ(program.wait(10), 2) << program.err();
    const std::string err = program.complaint();
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
    EXPECT_NE(err.find(path), std::string::npos) << err;
    EXPECT_NE(err.find(said), std::string::npos) << err;
  }
}

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
