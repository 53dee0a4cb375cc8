// The folder of chunk stores: its list, the stores that are deleted, the stores that stay.
#include "services/data/mesh/cache.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "common/core/descriptor.h"
#include "services/data/kinds.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

class CacheFolder : public testing::Test {
 protected:
  CacheFolder() {
    root_ = fs::temp_directory_path() /
            (std::string("telesplat-cache-") + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  ~CacheFolder() override { fs::remove_all(root_); }

  std::string folder() const { return root_ / "cache"; }
  // Makes a different mesh for each name.
  std::string mesh(const std::string& name) const {
    const std::string path = root_ / (name + ".off");
    std::ofstream(path) << "OFF\n3 1 0\n0 0 0\n1 0 0\n0 " << name.size() << " 0\n3 0 1 2\n";
    return path;
  }
  std::shared_ptr<MeshStore> opened(const std::string& name) const {
    MeshOptions options;
    options.cache_dir = folder();
    const auto store = open_mesh(mesh(name), options, {});
    EXPECT_TRUE(store.ok()) << store.error().text;
    return store ? *store : nullptr;
  }
  std::vector<CachedStore> stores() const { return *cached_stores(folder()); }
  // s: seconds ago.
  void last_used(const std::string& name, int s) const {
    for (const auto& store : stores())
      if (store.source.ends_with("/" + name + ".off"))
        fs::last_write_time(store.stem + ".used", fs::file_time_type::clock::now() - std::chrono::seconds(s));
  }
  std::vector<std::string> names() const {
    std::vector<std::string> out;
    for (const auto& store : stores()) out.push_back(fs::path(store.source).stem());
    return out;
  }
  fs::path root_;
};

TEST_F(CacheFolder, TellsSourceContentSizeAndUse) {
  EXPECT_TRUE(stores().empty()) << "there is no folder";
  opened("one");
  const auto all = stores();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].source, root_ / "one.off");
  EXPECT_EQ(all[0].content, "off, 1 triangles");
  EXPECT_EQ(all[0].bytes, fs::file_size(all[0].stem + ".mesh"));
  EXPECT_TRUE(all[0].finished);
  EXPECT_FALSE(all[0].in_use);
  EXPECT_NEAR(all[0].used_s, double(time(nullptr)), 60);
}

TEST_F(CacheFolder, TheOneUnusedForLongestComesFirstAndOpeningIsUse) {
  for (const char* name : {"a", "bb", "ccc"}) opened(name);
  last_used("a", 30), last_used("bb", 300), last_used("ccc", 3000);
  EXPECT_EQ(names(), (std::vector<std::string>{"ccc", "bb", "a"}));
  EXPECT_TRUE(opened("ccc")->info().from_cache);
  EXPECT_EQ(names(), (std::vector<std::string>{"bb", "a", "ccc"}));
}

TEST_F(CacheFolder, ClearingLeavesWhatIsNotOurs) {
  opened("one");
  const std::vector<std::string> others{"notes.txt", "0123456789abcdef-mine.mesh", "0123456789abcdef.mesh", "x.lock"};
  for (const auto& name : others) std::ofstream(folder() + "/" + name) << "not ours";
  fs::create_directory(folder() + "/0123456789abcdef-folder.part");
  fs::create_symlink(root_ / "one.off", folder() + "/0123456789abcdef-link.part");
  ASSERT_TRUE(set_cache_limit(folder(), 1000).ok());
  const auto removed = clear_cache(folder());
  ASSERT_TRUE(removed.ok());
  EXPECT_EQ(removed->stores, 1u);
  EXPECT_GT(removed->bytes, 0u);
  EXPECT_TRUE(stores().empty());
  for (const auto& name : others) EXPECT_TRUE(fs::exists(folder() + "/" + name)) << name;
  EXPECT_TRUE(fs::exists(folder() + "/0123456789abcdef-folder.part"));
  EXPECT_TRUE(fs::is_symlink(folder() + "/0123456789abcdef-link.part"));
  EXPECT_EQ(cache_limit(folder()), 1000u) << "a setting is no store";
  EXPECT_EQ(std::distance(fs::directory_iterator(folder()), {}), 7) << "no lock or note of the store is left";
}

TEST_F(CacheFolder, AStoreThatALiveProcessUsesStays) {
  const auto store = opened("one");
  EXPECT_TRUE(stores().at(0).in_use);
  auto removed = clear_cache(folder());
  ASSERT_TRUE(removed.ok());
  EXPECT_EQ(removed->stores, 0u);
  EXPECT_EQ(removed->in_use, 1u);
  EXPECT_EQ(bound_cache(folder(), 0)->in_use, 1u);
  EXPECT_TRUE(stores().at(0).finished);
}

TEST_F(CacheFolder, AStoreOfAProcessThatDiedGoes) {
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {
    const auto store = opened("one");
    (void)!write(ready[1], "x", 1);
    pause();
  }
  char byte;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_EQ(clear_cache(folder())->in_use, 1u);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_EQ(clear_cache(folder())->stores, 1u);
  close(ready[0]), close(ready[1]);
}

TEST_F(CacheFolder, AStoreThatIsBeingMadeStaysAndItsLeftoversGo) {
  fs::create_directories(folder());
  const std::string stem = folder() + "/0123456789abcdef-auto-1";
  std::ofstream(stem + ".part") << std::string(5000, 'x');
  {
    const auto making = Descriptor::open_file(stem + ".lock", O_RDWR | O_CREAT);
    ASSERT_TRUE(making.lock(LOCK_EX));
    EXPECT_EQ(clear_cache(folder())->in_use, 1u);
    EXPECT_TRUE(fs::exists(stem + ".part"));
  }
  const auto removed = clear_cache(folder());
  EXPECT_EQ(removed->stores, 1u);
  EXPECT_EQ(removed->bytes, 5000u);
  EXPECT_TRUE(fs::is_empty(folder()));
}

TEST_F(CacheFolder, TheLimitHoldsWheneverAStoreIsMade) {
  for (const char* name : {"a", "bb", "ccc"}) opened(name);
  last_used("a", 30), last_used("bb", 3000), last_used("ccc", 300);
  const uint64_t one = stores().at(0).bytes;
  ASSERT_TRUE(set_cache_limit(folder(), 2 * one + one / 2).ok());
  const auto store = opened("dddd");
  EXPECT_EQ(names(), (std::vector<std::string>{"a", "dddd"}));
  ASSERT_FALSE(store->info().notes.empty());
  EXPECT_NE(store->info().notes.back().find("2 unused for longest removed"), std::string::npos)
      << store->info().notes.back();
  ASSERT_TRUE(set_cache_limit(folder(), 1).ok());
  EXPECT_TRUE(opened("eeeee")) << "larger than the limit, but in use";
  EXPECT_EQ(names(), (std::vector<std::string>{"dddd", "eeeee"})) << "both are, or were";
}

TEST_F(CacheFolder, GrowthIsToldOnceAndOnlyOfALargeFolder) {
  EXPECT_TRUE(opened("none")->info().notes.empty());
  fs::resize_file(stores().at(0).stem + ".mesh", 1'200'000'000);
  const auto made = opened("one");
  ASSERT_EQ(made->info().notes.size(), 1u);
  EXPECT_TRUE(made->info().notes[0].starts_with("the cache holds 2 stores, 1.2 GB, in ")) << made->info().notes[0];
  EXPECT_TRUE(made->info().notes[0].ends_with("; telesplat cache limit 20GB bounds it")) << made->info().notes[0];
  EXPECT_TRUE(opened("one")->info().notes.empty());
}

TEST_F(CacheFolder, LimitsAreRememberedAndTakenBack) {
  EXPECT_EQ(cache_limit(folder()), std::nullopt);
  ASSERT_TRUE(set_cache_limit(folder(), 20'000'000'000).ok());
  EXPECT_EQ(cache_limit(folder()), 20'000'000'000u);
  ASSERT_TRUE(set_cache_limit(folder(), std::nullopt).ok());
  EXPECT_EQ(cache_limit(folder()), std::nullopt);
  std::ofstream(folder() + "/limit") << "much\n";
  EXPECT_EQ(cache_limit(folder()), std::nullopt);
}

TEST_F(CacheFolder, APlaceThatOthersMayWriteToIsNotUsed) {
  const fs::path shared = fs::temp_directory_path() / fmt::format("telesplat-test-{}", getpid());
  fs::create_directory(shared);
  fs::permissions(shared, fs::perms::owner_all);
  EXPECT_EQ(problem_of_shared_place(shared), "");
  fs::permissions(shared, fs::perms::all);
  EXPECT_EQ(problem_of_shared_place(shared), "others may write into it");
  MeshOptions options;
  options.cache_dir = shared;
  const auto store = open_mesh(mesh("one"), options, {});
  ASSERT_TRUE(store.ok()) << store.error().text;
  EXPECT_TRUE(fs::is_empty(shared));
  fs::remove(shared);
  fs::create_directory_symlink(root_, shared);
  EXPECT_EQ(problem_of_shared_place(shared), "is no folder");
  fs::remove(shared);
  EXPECT_EQ(problem_of_shared_place(root_ / "cache"), "") << "nobody shares it";
}

TEST_F(CacheFolder, OneThatWaitsForAnotherMakerTellsAndMayGiveUp) {
  opened("one");
  const std::string stem = stores()[0].stem;
  fs::remove(stem + ".mesh");
  const auto lock = Descriptor::open_file(stem + ".lock", O_RDWR | O_CREAT);
  ASSERT_TRUE(lock.lock(LOCK_EX));
  struct GivenUp {};
  MeshOptions options;
  options.cache_dir = folder();
  int told = 0;
  const auto tell = [&](const char* stage, double) {
    if (std::string(stage).find("another process") == std::string::npos) return;
    if (++told == 3) throw GivenUp();
  };
  EXPECT_THROW(open_mesh(mesh("one"), options, tell).ok(), GivenUp);
  EXPECT_EQ(told, 3) << "again and again, so that it can be given up";
}

TEST(CacheSizes, AreReadAndWrittenAsPeopleDo) {
  for (const auto& [text, bytes] : std::vector<std::pair<std::string, uint64_t>>{{"20GB", 20'000'000'000},
                                                                                 {"1.5 TB", 1'500'000'000'000},
                                                                                 {"500M", 500'000'000},
                                                                                 {"7kb", 7000},
                                                                                 {"1000", 1000},
                                                                                 {"0", 0}})
    EXPECT_EQ(*parse_size(text), bytes) << text;
  for (const char* text : {"", "GB", "-1GB", "nan", "inf", "1e30", "20 parsecs", "20GBB"})
    EXPECT_FALSE(parse_size(text).ok()) << text;
  EXPECT_EQ(size_text(999), "999 bytes");
  EXPECT_EQ(size_text(1000), "1 kB");
  EXPECT_EQ(size_text(1'740'000'000), "1.7 GB");
  EXPECT_EQ(size_text(999'700), "1 MB");
  EXPECT_EQ(size_text(20'000'000'000), "20 GB");
}

}  // namespace
}  // namespace telesplat::data
