// Content hashes of large files: known again without reading the files, and never wrong.
#include "services/data/mesh/known_files.h"

#include <sys/stat.h>

#include "services/data/mesh/cache.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

namespace fs = std::filesystem;

class KnownFiles : public testing::Test {
 protected:
  struct Hashed {
    uint64_t hash = 0;
    bool was_read = false;
    bool operator==(const Hashed&) const = default;
  };
  Hashed hash(const std::vector<std::string>& paths) const {
    Hashed out;
    out.hash = hash_known_files(paths, memory_, [&](const char*, double fraction) { out.was_read |= fraction < 1; });
    EXPECT_EQ(out.hash, hash_files(paths, [](const char*, double) {}));
    return out;
  }
  bool reads(const std::vector<std::string>& paths) const { return hash(paths).was_read; }
  std::string record() const { return memory_.folder + "/" + kKnownFile; }

  TempFolder folder_;
  HashMemory memory_{.folder = folder_ / "cache", .least_bytes = 1000, .settled_s = 0};
  std::string file_ = folder_.write("a.ply", std::string(1'000'000, 'x'));
};

TEST_F(KnownFiles, AreReadOnce) {
  const std::string second = folder_.write("b.mtl", "newmtl"), missing = folder_ / "missing";
  EXPECT_TRUE(reads({file_, second, missing}));
  EXPECT_FALSE(reads({file_, second, missing}));
  EXPECT_TRUE(reads({file_})) << "other files";
  folder_.write("missing", "there");
  EXPECT_TRUE(reads({file_, second, missing}));
}

// Changes a byte between two sampled blocks and sets the old time: only the inode's time tells.
TEST_F(KnownFiles, AChangeIsNoticedThoughSizeAndTimeStay) {
  const auto changed = [&] {
    struct stat s {};
    stat(file_.c_str(), &s);
    return std::pair(s.st_ctim.tv_sec, s.st_ctim.tv_nsec);
  };
  const auto time = fs::last_write_time(file_);
  const Hashed before = hash({file_});
  const auto begin = changed();
  while (changed() == begin) {
    std::fstream(file_, std::ios::in | std::ios::out).seekp(10'000).put('y');
    fs::last_write_time(file_, time);
  }
  const Hashed after = hash({file_});
  EXPECT_TRUE(after.was_read);
  EXPECT_NE(after.hash, before.hash);
}

TEST_F(KnownFiles, SmallOnesAreNotRemembered) {
  memory_.least_bytes = 1'000'001;
  EXPECT_TRUE(reads({file_}));
  EXPECT_TRUE(reads({file_}));
  EXPECT_FALSE(fs::exists(record()));
}

TEST_F(KnownFiles, OnesThatChangedJustNowAreNotRemembered) {
  memory_.settled_s = 3600;
  EXPECT_TRUE(reads({file_}));
  EXPECT_TRUE(reads({file_}));
}

TEST_F(KnownFiles, ADamagedRecordCountsForNothing) {
  hash({file_});
  std::ifstream in(record(), std::ios::binary);
  const std::string good(std::istreambuf_iterator<char>(in), {});
  ASSERT_GT(good.size(), kKnownBegin.size());
  for (size_t at = kKnownBegin.size(); at + 1 < good.size(); ++at) {
    std::string bad = good;
    bad[at] ^= 1;
    std::ofstream(record(), std::ios::binary) << bad;
    ASSERT_TRUE(reads({file_})) << at;
    ASSERT_FALSE(reads({file_})) << "it is recorded again";
    std::ofstream(record(), std::ios::binary) << good.substr(0, at);
    ASSERT_TRUE(reads({file_})) << at;
  }
}

TEST_F(KnownFiles, TheRecordStaysSmall) {
  fs::create_directories(memory_.folder);
  std::ofstream(record()) << kKnownBegin << std::string(100'000, '\n');
  hash({file_});
  EXPECT_LT(fs::file_size(record()), 100u);
  EXPECT_FALSE(reads({file_}));
}

TEST_F(KnownFiles, ForeignFilesAndLinksStay) {
  fs::create_directories(memory_.folder);
  std::ofstream(record()) << "mine";
  EXPECT_TRUE(reads({file_}));
  ASSERT_TRUE(clear_cache(memory_.folder).ok());
  EXPECT_EQ(fs::file_size(record()), 4u);
  fs::remove(record());
  fs::create_symlink(folder_ / "not-there", record());
  EXPECT_TRUE(reads({file_}));
  EXPECT_FALSE(fs::exists(folder_ / "not-there"));
  memory_.folder = file_;
  EXPECT_TRUE(reads({file_})) << "a file in place of a folder";
}

TEST_F(KnownFiles, ClearingTheCacheForgetsThem) {
  hash({file_});
  ASSERT_TRUE(fs::exists(record()));
  ASSERT_TRUE(clear_cache(memory_.folder).ok());
  EXPECT_TRUE(fs::is_empty(memory_.folder));
}

}  // namespace
}  // namespace telesplat::data::test
