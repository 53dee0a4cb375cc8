// Files that cannot be shown are refused: exit code 2, one line that names the file, nothing left behind.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

TEST(BadInput, ExitsWithTwoAndOneLine) {
  TemporaryFolder folder;
  const std::string path = folder / "cut.ply", out = folder / "out";
  write_terrain(path, 40);
  fs::resize_file(path, fs::file_size(path) / 2);
  Program program("telesplat", {"run", path, "--out", out, "--cache", folder / "cache", "--duration", "1"},
                  folder / "telesplat");
  EXPECT_EQ(program.wait(60), 2) << program.err();
  const std::string err = program.complaint();
  EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
  EXPECT_TRUE(err.starts_with("telesplat: ")) << err;
  EXPECT_NE(err.find("cut.ply"), std::string::npos) << err;
  EXPECT_FALSE(fs::exists(out)) << "a run folder was left";
  EXPECT_TRUE(wait_until([&] {
    for (const auto& entry : fs::directory_iterator("/proc"))
      if (const pid_t pid = std::atoi(entry.path().filename().c_str());
          pid > 0 && is_running(pid) && read_text(entry.path() / "cmdline").find(folder.path()) != std::string::npos)
        return false;
    return true;
  }));
}

// Its libraries take a second to load, and as long it is not told of its parent's end.
TEST(Import, EndsWhereTheProcessThatWantedItDiedBefore) {
  TemporaryFolder folder;
  const std::string path = folder / "empty.gltf";  // why it is refused is an answer, too
  for (const bool here : {true, false}) {
    ::setenv("TELESPLAT_IMPORT_PARENT", std::to_string(here ? getpid() : 1).c_str(), 1);
    Program import("telesplat-import", {"gltf", path, "1000"}, folder / "import");
    EXPECT_EQ(import.wait(), here ? 0 : 1);
    EXPECT_NE(import.out().empty(), here);
  }
  ::unsetenv("TELESPLAT_IMPORT_PARENT");
}

// Returns the output of a data server that is started by hand.
TEST(DataServer, AFileThatIsCutOffWhileItIsReadIsNamed) {
  TemporaryFolder folder;
  const std::string path = folder / "cut.ply";
  write_terrain(path, 900);
  Program data("telesplat-data", {path, "--no-cache", "--report-progress", "--name", "data"}, folder / "data");
  ASSERT_TRUE(wait_until([&] { return data.out().find("progress reading") != std::string::npos; })) << data.err();
  fs::resize_file(path, 10'000);
  EXPECT_EQ(data.wait(60), 2) << data.err();
  EXPECT_NE(data.err().find("telesplat: " + path + ": was cut off while it was read\n"), std::string::npos)
      << data.err();
}

// The launcher's own commands map files more than once. One that is cut off between two times has a header that claims
// too much.
TEST(LauncherFile, ThatIsCutOffWhileItIsReadIsNamed) {
  TemporaryFolder folder;
  const std::string path = folder / "cut.ply";
  write_terrain(path, 900);
  Program inspect("telesplat", {"inspect", path}, folder / "inspect");
  const std::string maps = fmt::format("/proc/{}/maps", inspect.pid());
  ASSERT_TRUE(wait_until([&] {
    std::ifstream in(maps);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    return text.find("cut.ply") != text.npos;
  }));
  fs::resize_file(path, 10'000);
  EXPECT_EQ(inspect.wait(60), 2) << inspect.out();
  const std::string said = inspect.err(), named = "telesplat: " + path + ": ";
  EXPECT_EQ(said.find(named), 0u) << said;
  EXPECT_TRUE(said.find(named + "was cut off while it was read\n") != said.npos ||
              said.find("but only 9760 bytes follow it\n") != said.npos)
      << said;
}

TEST(DataServer, ReadsWhatAFileNamesBelowItsFolderUnlessItIsTold) {
  TemporaryFolder folder;
  fs::create_directories(folder / "data");
  std::string voxels(16 * 16 * 16, '\0');
  for (size_t i = 0; i < voxels.size(); ++i) voxels[i] = char(i / 16);
  std::ofstream(folder / "voxels", std::ios::binary) << voxels;
  const std::string path = folder / "data/a.nhdr";
  std::ofstream(path) << "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 16 16 16\nencoding: raw\ndata file: ../voxels\n";
  Program refuses("telesplat-data", {path, "--name", "data"}, folder / "refuses");
  EXPECT_EQ(refuses.wait(30), 2);
  EXPECT_EQ(refuses.err(),
            "telesplat: " + path + ": names " + folder.path() +
                "/data/../voxels, which lies outside of its folder; --companions anywhere allows that\n");
  Program allowed("telesplat-data", {path, "--name", "data", "--companions", "anywhere"}, folder / "allowed");
  EXPECT_TRUE(wait_until([&] { return allowed.err().find("ready in") != std::string::npos; })) << allowed.err();
  // The person's own command reads the person's own files.
  Program run("telesplat", {"run", path, "--duration", "0.5", "--size", "64x40", "--out", folder / "run"},
              folder / "run-log");
  EXPECT_EQ(run.wait(60), 0) << run.err();
}

TEST(BadUsage, UnknownFlagsAndAbsentScenesAreRefused) {
  TemporaryFolder folder;
  // It asks for some seconds.
  Program ctl("telesplat", {"ctl", "status", "--master", "tcp://127.0.0.1:1"}, folder / "ctl");
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"run"}, {"run", "--no-such-flag"}, {"walk"}, {}, {"inspect", folder / "nothing"}}) {
    Program program("telesplat", arguments, folder / "telesplat");
    EXPECT_EQ(program.wait(30), 2) << program.err();
    EXPECT_FALSE(program.err().empty());
  }
  EXPECT_EQ(ctl.wait(30), 1);
  EXPECT_NE(ctl.err().find("tcp://127.0.0.1:1"), std::string::npos);
}

}  // namespace
}  // namespace telesplat::test
