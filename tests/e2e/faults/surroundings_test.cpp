// Faults around a session: the data set changes, disks are full, the wall clock is set, names are not UTF-8, all
// processes are told to stop at once.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/e2e/faults/fault.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

TEST(OtherData, AServerThatComesBackWithAnotherMeshIsAdopted) {
  TemporaryFolder folder;
  write_terrain(folder / "land.ply", 100);
  Fault fault("kill -9 of the data server; the file holds another mesh when it is back", {}, folder / "land.ply");
  ASSERT_TRUE(fault.showing());
  const auto before = fault.run().status();
  write_terrain(folder / "other.ply", 60);
  fault.begins();
  fs::rename(folder / "other.ply", folder / "land.ply");
  const pid_t killed = fault.signal("data", SIGKILL);
  fault.ends();
  EXPECT_TRUE(fault.wait_new_life("data", killed));
  EXPECT_TRUE(fault.run().wait_status([&](const auto& s) {
    return s["epoch"] > before["epoch"] && value(s, "viewer-1", "epoch") == s["epoch"];
  })) << "the other mesh is not shown";
  fault.expect_resynchronised();
  fault.finish();
  EXPECT_EQ(fault.run().summary()["primitives"], 2 * 60 * 60);
}

TEST(OtherData, AServerThatComesBackWithAnotherVolumeIsAdoptedOrRefusedInALine) {
  TemporaryFolder folder;
  write_volume(folder / "balls.mha", 40);
  Fault fault("kill -9 of a volume's data server; the file holds a volume of another size when it is back", {},
              folder / "balls.mha");
  ASSERT_TRUE(fault.showing());
  const pid_t master = fault.pid_of("master");
  write_volume(folder / "other.mha", 24, 0.3);
  fault.begins();
  fs::rename(folder / "other.mha", folder / "balls.mha");
  const pid_t killed = fault.signal("data", SIGKILL);
  fault.ends();
  EXPECT_TRUE(fault.wait_new_life("data", killed));
  fault.expect_updates();
  EXPECT_EQ(fault.pid_of("master"), master) << "the master died of it";
  fault.finish();
}

// A disk of a few MB, mounted while this lives, on which everything that is made in a temporary folder lies.
class SmallDisk {
 public:
  explicit SmallDisk(int mb) {
    mounted_ = ::mount("tmpfs", folder_.path().c_str(), "tmpfs", 0, fmt::format("size={}m", mb).c_str()) == 0;
    if (!mounted_) why_ = std::strerror(errno);
    const char* before = std::getenv("TMPDIR");
    before_ = before ? before : "";
    if (mounted_) ::setenv("TMPDIR", folder_.path().c_str(), 1);
  }
  ~SmallDisk() {
    if (!mounted_) return;
    before_.empty() ? ::unsetenv("TMPDIR") : ::setenv("TMPDIR", before_.c_str(), 1);
    ::umount2(folder_.path().c_str(), MNT_DETACH);
  }
  bool mounted() const { return mounted_; }
  const std::string& why() const { return why_; }
  void fill() {
    std::ofstream out(ballast(), std::ios::binary);
    const std::string block(4096, 'x');
    while (out.write(block.data(), long(block.size())).flush()) {
    }
  }
  void relieve() {
    std::error_code error;
    fs::remove(ballast(), error);
  }

 private:
  std::string ballast() const { return folder_ / "ballast"; }
  TemporaryFolder folder_;
  bool mounted_ = false;
  std::string why_, before_;
};

size_t count_of(const std::string& text, const std::string& what) {
  size_t n = 0;
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

TEST(FullDisk, UnderTheRecordIsToldAndTheRunGoesOn) {
  SmallDisk disk(64);
  if (!disk.mounted()) GTEST_SKIP() << "a disk of its own cannot be mounted: " << disk.why();
  Fault fault("the disk is full under the record and the frames that wait to become pictures", {"--record-every", "2"});
  ASSERT_TRUE(fault.showing());
  fault.begins();
  disk.fill();
  pass(4);
  fault.ends();
  fault.expect_resynchronised();
  disk.relieve();
  fault.finish(1);
  EXPECT_GE(fault.run().summary()["errors"].value("record_failed", 0), 1) << fault.run().summary()["errors"].dump();
  std::string logs = fault.run().program().err();
  for (const char* name : {"master", "viewer-1"}) logs += read_text(fault.run().out() + "/logs/" + name + ".log");
  EXPECT_GE(count_of(logs, "No space left"), 1u) << logs;
  EXPECT_LT(count_of(logs, "No space left"), 12u) << "once a file, not once a frame";
}

TEST(FullDisk, FromTheBeginningIsTheReasonThatIsTold) {
  TemporaryFolder folder;
  const std::string mesh = folder / "mesh.ply";
  write_terrain(mesh, 8);
  SmallDisk disk(1);
  if (!disk.mounted()) GTEST_SKIP() << "a disk of its own cannot be mounted: " << disk.why();
  TemporaryFolder on_disk;
  ::unsetenv("TMPDIR");  // the rest lies elsewhere
  std::ofstream(on_disk / "ballast", std::ios::binary) << std::string(700 << 10, 'x');
  Program run("telesplat",
              {"run", mesh, "--no-cache", "--out", on_disk / "run", "--size", "320x240", "--duration", "3"},
              folder / "run");
  EXPECT_EQ(run.wait(), 1) << run.err();
  EXPECT_NE(run.err().find(on_disk / "run"), std::string::npos) << run.err();
  EXPECT_GE(count_of(run.err(), "No space left on device"), 1u) << run.err();
}

TEST(NoLoopback, IsSaidInSeconds) {
  TemporaryFolder folder;
  const std::string mesh = folder / "mesh.ply";
  write_terrain(mesh, 8);
  Program possible("/usr/bin/unshare", {"-n", "true"}, folder / "possible");
  if (possible.wait() != 0) GTEST_SKIP() << "no network of its own: " << possible.err();
  Program run("/usr/bin/unshare",
              {"-n", std::string(TELESPLAT_BIN) + "/telesplat", "run", mesh, "--no-cache", "--out", folder / "out"},
              folder / "run");
  EXPECT_EQ(run.wait(20), 1) << run.err();
  EXPECT_NE(run.err().find("cannot be reached at tcp://127.0.0.1:"), std::string::npos) << run.err();
  EXPECT_NE(run.err().find("loopback"), std::string::npos) << run.err();
  EXPECT_FALSE(fs::exists(folder / "out")) << "a run folder was left";
}

TEST(FullDisk, UnderTheChunkStoreIsNoReasonNotToShowTheMesh) {
  SmallDisk disk(8);
  if (!disk.mounted()) GTEST_SKIP() << "a disk of its own cannot be mounted: " << disk.why();
  TemporaryFolder on_disk;
  ::unsetenv("TMPDIR");  // the rest lies elsewhere
  disk.fill();
  Fault fault("the disk is full under the chunk store", {"--cache", on_disk / "cache"});
  ASSERT_TRUE(fault.showing());
  fault.begins();
  fault.ends();
  fault.expect_resynchronised();
  fault.finish();
}

std::string faketime_library() {
  for (const char* path : {"/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1",
                           "/usr/lib/aarch64-linux-gnu/faketime/libfaketimeMT.so.1"})
    if (fs::exists(path)) return path;
  return "";
}

// Times are counted on the monotonic clock: a wall clock that is set changes names of files at most.
TEST(WallClock, SteppedByAnHourForthAndBackChangesNothing) {
  const std::string library = faketime_library();
  if (library.empty()) GTEST_SKIP() << "libfaketime is not installed (tools/setup --developer)";
  TemporaryFolder folder;
  const std::string clock = folder / "clock";
  const auto set = [&](const char* to) { std::ofstream(clock) << to << "\n"; };
  set("+0");
  const std::pair<const char*, std::string> told[] = {{"LD_PRELOAD", library},
                                                      {"FAKETIME_TIMESTAMP_FILE", clock},
                                                      {"FAKETIME_NO_CACHE", "1"},
                                                      {"FAKETIME_DONT_FAKE_MONOTONIC", "1"}};
  for (const auto& [name, text] : told) ::setenv(name, text.c_str(), 1);
  Fault fault("the wall clock is set an hour forth, then back");
  for (const auto& [name, text] : told) ::unsetenv(name);
  ASSERT_TRUE(fault.showing());
  fault.begins();
  set("+3600");
  pass(2);
  set("-3600");
  pass(2);
  fault.ends();
  fault.expect_resynchronised();
  EXPECT_EQ(fault.run().status().value("leases_expired", 0.0), 0);
  fault.finish();
}

TEST(Latin1, NamesOfFilesAreShownAndRecorded) {
  TemporaryFolder folder;
  const std::string file = folder / "caf\xe9.ply";
  write_terrain(file);
  Fault fault("the data set's file has a name in Latin-1", {}, file);
  ASSERT_TRUE(fault.showing());
  fault.begins();
  Program ctl("telesplat", {"ctl", "--master", fault.run().master(), "status"}, fault.run().folder() / "ctl");
  EXPECT_EQ(ctl.wait(), 0) << ctl.err();
  EXPECT_NE(ctl.out().find("caf"), std::string::npos);
  fault.ends();
  fault.expect_resynchronised();
  fault.finish();
  EXPECT_TRUE(fault.run().summary().is_object());
}

// Children of the launcher.
std::vector<pid_t> children_of(pid_t pid) {
  std::istringstream in(read_text(fmt::format("/proc/{0}/task/{0}/children", pid)));
  std::vector<pid_t> out;
  for (pid_t child = 0; in >> child;) out.push_back(child);
  return out;
}

TEST(AllAtOnce, ToldToStopEverybodyLeavesInOrder) {
  Fault fault("SIGTERM of everything at once", {"--samplers", "2"});
  ASSERT_TRUE(fault.showing());
  auto all = children_of(fault.run().program().pid());
  ASSERT_GE(all.size(), 6u);
  all.push_back(fault.run().program().pid());
  for (const pid_t pid : all) ::kill(pid, SIGTERM);
  EXPECT_TRUE(wait_until([&] { return fault.run().program().wait(0) >= 0; }, 20));
  fault.finish_ended(0);
  EXPECT_TRUE(fault.run().summary().is_object()) << "the record is complete";
  EXPECT_EQ(fault.run().program().err().find("died"), std::string::npos) << fault.run().program().err();
}

}  // namespace
}  // namespace telesplat::test
