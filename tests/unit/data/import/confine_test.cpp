// Rights of the process that reads other people's files.
#include "services/data/import/confine.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <functional>
#include <new>
#include <thread>

#include "services/data/import/files.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

constexpr uint64_t kMemory = uint64_t{4} << 30;

// Runs `call` in a confined process of its own and returns its result, 0..100; or 128 and the signal that ended it.
int in_confinement(const std::function<int()>& call) {
  const pid_t child = fork();
  if (child == 0) {
    confine(kMemory);
    _exit(call());
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

int opens(const std::string& path, int how) { return ::open(path.c_str(), how, 0600) < 0 ? 1 : 0; }

class Confined : public testing::Test {
 protected:
  void SetUp() override {
#ifdef TELESPLAT_SANITIZED
    GTEST_SKIP() << "sanitizers open files and write them, so that sanitized programs are not confined";
#endif
    if (const std::string missing = not_confined(); !missing.empty()) GTEST_SKIP() << "this kernel lacks " << missing;
  }
  const TempFolder folder;
};

TEST_F(Confined, NoFileOfTheUserIsOpened) {
  const std::string key = folder.write("server.key", "secret");
  EXPECT_EQ(in_confinement([&] { return opens(key, O_RDONLY); }), 1);
  EXPECT_EQ(in_confinement([&] { return opens("/etc/passwd", O_RDONLY); }), 1);
  EXPECT_EQ(in_confinement([&] { return opens("/proc/self/environ", O_RDONLY); }), 1);
  EXPECT_EQ(in_confinement([&] { return opens("/usr/share/zoneinfo", O_RDONLY | O_DIRECTORY); }), 0);
}

TEST_F(Confined, NoFileIsWritten) {
  EXPECT_EQ(in_confinement([&] { return opens(folder / "new", O_WRONLY | O_CREAT); }), 1);
  EXPECT_EQ(in_confinement([&] { return opens("/usr/bin/new", O_RDWR | O_CREAT); }), 1);
  const std::string kept = folder.write("kept", "x");
  EXPECT_EQ(in_confinement([&] { return unlink(kept.c_str()) < 0; }), 1);
  EXPECT_EQ(in_confinement([&] { return rename(kept.c_str(), (folder / "other").c_str()) < 0; }), 1);
}

TEST_F(Confined, NoSocketNoProgramNoOtherProcess) {
  EXPECT_EQ(in_confinement([] { return socket(AF_INET, SOCK_STREAM, 0) < 0; }), 1);
  EXPECT_EQ(in_confinement([] { return socket(AF_UNIX, SOCK_STREAM, 0) < 0; }), 1);
  EXPECT_EQ(in_confinement([] { return execl("/usr/bin/true", "true", nullptr) < 0; }), 1);
  EXPECT_EQ(in_confinement([] { return kill(getppid(), 0) < 0; }), 1);
}

TEST_F(Confined, MemoryAndOutputEnd) {
  EXPECT_EQ(in_confinement(
                [] { return mmap(nullptr, 2 * kMemory, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) == MAP_FAILED; }),
            1);
  const int output = memfd_create("output", 0);
  EXPECT_EQ(in_confinement([&] { return pwrite(output, "x", 1, off_t(kMemory) + 1) == 1; }), 128 + SIGXFSZ);
  close(output);
}

TEST_F(Confined, ThreadsAndOpenFilesStillWork) {
  const int file = ::open(folder.write("open", "content").c_str(), O_RDONLY);
  const int output = memfd_create("output", 0);
  EXPECT_EQ(in_confinement([&] {
              int good = 0;
              std::thread([&] {
                char text[8] = {};
                good = pread(file, text, 7, 0) == 7 && std::string(text) == "content" && write(output, text, 7) == 7;
              }).join();
              return good;
            }),
            1);
  close(file), close(output);
}

TEST(ImportFiles, ComeByTheirNames) {
  const TempFolder folder;
  std::filesystem::create_directories(folder / "below");
  const std::string first = folder.write("a.vrt", "first"), second = folder.write("below/b", "second");
  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends), 0);
  std::vector<std::string> paths{first, folder / "missing", second, folder / "below"};
  for (int i = 0; i < 300; ++i) paths.push_back(folder.write(fmt::format("many{}", i), "x"));
  std::thread sender([&] { send_files(ends[0], paths), close(ends[0]); });
  ImportFiles files(ends[1]);
  sender.join();
  close(ends[1]);
  EXPECT_EQ(files.all().size(), 302u) << "what is no file is left out";
  EXPECT_EQ(*files.content(), "first");
  for (const char* name : {"below/b", "./below/b", "below/../below/b"}) EXPECT_EQ(*files.read(name), "second") << name;
  EXPECT_EQ(files.bytes(), 5u + 6 + 300);
  for (const char* name : {"missing", "../a.vrt", "/etc/passwd", ""}) {
    const auto content = files.read(name);
    ASSERT_FALSE(content) << name;
    EXPECT_NE(content.error().text.find("no such file"), std::string::npos);
  }
}

}  // namespace
}  // namespace telesplat::data::test
