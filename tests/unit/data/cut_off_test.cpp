// If another process cuts off a mapped file, the reader ends with one line that names it.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "services/data/base/mapped_file.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

uint64_t sum_of(std::span<const std::byte> bytes) {
  uint64_t out = 0;
  for (const std::byte b : bytes) out += uint64_t(b);
  return out;
}

// Runs in a process of its own.
void read_cut_off(const std::string& path, int exit_code) {
  const auto whole = MappedFile::open(path);
  const auto other = MappedFile::open("/proc/self/exe");
  if (!whole || !other) _exit(100);
  end_at_cut_off_files(exit_code);
  const uint64_t before = sum_of((*whole)->bytes());
  if (truncate(path.c_str(), 10) != 0) _exit(101);
  _exit(sum_of((*whole)->bytes()) == before ? 102 : 103);
}

TEST(CutOffDeathTest, EndsItsReaderInOneLineThatNamesIt) {
  const TempFolder folder;
  for (const int code : {2, 1}) {
    const std::string path = folder.write("cut.ply", std::string(100'000, 'x'));
    EXPECT_EXIT(read_cut_off(path, code), testing::ExitedWithCode(code),
                "^telesplat: " + path + ": was cut off while it was read\n$");
  }
}

TEST(CutOffDeathTest, OfALongNameTheEndIsTold) {
  const TempFolder folder;
  const std::string name = std::string(200, 'a') + "-end.ply";
  std::filesystem::create_directories(folder / std::string(100, 'b'));
  const std::string path = folder.write(std::string(100, 'b') + "/" + name, std::string(100'000, 'x'));
  EXPECT_EXIT(read_cut_off(path, 2), testing::ExitedWithCode(2), "\\.\\.\\.b.*/a+-end\\.ply: was cut off");
}

// A bus error outside mapped files is not blamed on a file.
TEST(CutOffDeathTest, OtherBusErrorsEndTheProcessAsBefore) {
  EXPECT_EXIT(
      {
        end_at_cut_off_files(2);
        const auto file = MappedFile::open("/proc/self/exe");
        const int descriptor = memfd_create("other", 0);
        if (!file || ftruncate(descriptor, 100'000) != 0) _exit(100);
        const auto* bytes =
            static_cast<const volatile char*>(mmap(nullptr, 100'000, PROT_READ, MAP_SHARED, descriptor, 0));
        if (ftruncate(descriptor, 0) != 0) _exit(101);
        _exit(bytes[50'000]);
      },
      testing::KilledBySignal(SIGBUS), "^$");
}

// Places are reused: maps more files than there are places, one after the other, and all at once.
TEST(CutOffDeathTest, ManyMappingsHarmNothing) {
  const TempFolder folder;
  const std::string path = folder.write("a.ply", std::string(5000, 'x')),
                    last = folder.write("b.ply", std::string(100'000, 'x'));
  for (int i = 0; i < 3000; ++i) ASSERT_TRUE(MappedFile::open(path));
  {
    std::vector<std::shared_ptr<const MappedFile>> all;
    for (int i = 0; i < 3000; ++i) all.push_back(*MappedFile::open(path));
    EXPECT_EQ(sum_of(all.back()->bytes()), 5000 * uint64_t('x'));
  }
  EXPECT_EXIT(read_cut_off(last, 2), testing::ExitedWithCode(2), "b\\.ply: was cut off");
}

}  // namespace
}  // namespace telesplat::data::test
