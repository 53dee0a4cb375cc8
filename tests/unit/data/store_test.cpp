// The chunk store: data come back, a store is found again once made, and a damaged one is made anew.
#include <unistd.h>

#include <thread>

#include "common/core/descriptor.h"
#include "common/geometry/chunk_code.h"
#include "services/data/base/cut_off.h"
#include "services/data/inspect.h"
#include "services/data/mesh/store_file.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

namespace fs = std::filesystem;

MeshOptions cached_in(const std::string& folder) {
  MeshOptions options;
  options.cache_dir = folder;
  return options;
}

// A grid and a folder for its cache.
class StoreTest : public testing::Test {
 protected:
  TempFolder folder_;
  std::string path_ = folder_.write("grid.ply", ply_of(wavy_grid(40)));
  MeshOptions options_ = cached_in(folder_ / "cache");

  fs::path store_file() const {
    for (const auto& entry : fs::directory_iterator(options_.cache_dir))
      if (entry.path().extension() == ".mesh") return entry.path();
    return {};
  }
  size_t store_files() const {
    size_t count = 0;
    for (const auto& entry : fs::directory_iterator(options_.cache_dir)) count += entry.path().extension() == ".mesh";
    return count;
  }
};

TEST_F(StoreTest, KeepsEveryTriangleColourAndBox) {
  const auto store = open_or_fail(path_, options_);
  ASSERT_TRUE(store);
  const MeshStoreInfo& info = store->info();
  EXPECT_EQ(info.source, path_);
  EXPECT_EQ(info.format, "ply");
  EXPECT_EQ(info.triangles, 3200u);
  EXPECT_EQ(info.vertices, 41u * 41u);
  EXPECT_EQ(info.up, "z");  // a height field
  EXPECT_TRUE(info.had_colours);
  EXPECT_FALSE(info.had_normals);
  EXPECT_FALSE(info.from_cache);
  const Contents contents = contents_of(*store);
  ASSERT_EQ(contents.triangles.size(), 3200u);
  for (const auto& triangle : contents.triangles)
    for (const Corner& c : triangle) {
      // Data (i, j, h) with z up lies at ((i - 20), h, (20 - j)) * 0.8 / 40.
      const auto i = static_cast<uint32_t>(std::lround(c.position.x * 50 + 20)),
                 j = static_cast<uint32_t>(std::lround(20 - c.position.z * 50));
      EXPECT_EQ(c.colour, pack_rgb(i, j, i + j));
      EXPECT_NEAR(glm::length(c.normal), 1.0, 1e-4);
      EXPECT_GT(c.normal.y, 0.5f);
    }
}

TEST_F(StoreTest, SecondOpenIsFromTheCacheAndTheSame) {
  std::vector<std::string> stages;
  const auto first = open_or_fail(path_, options_);
  const auto again = open_mesh(path_, options_, [&](const char* stage, double fraction) {
    EXPECT_GE(fraction, 0.0);
    EXPECT_LE(fraction, 1.0);
    stages.push_back(stage);
  });
  ASSERT_TRUE(first && again.ok());
  EXPECT_TRUE((*again)->info().from_cache);
  EXPECT_EQ(std::count(stages.begin(), stages.end(), kReading), 0);
  EXPECT_EQ(first->chunks(), (*again)->chunks());
  EXPECT_EQ(first->info().box_data, (*again)->info().box_data);
  EXPECT_EQ(first->info().content_hash, (*again)->info().content_hash);
  for (const auto& chunk : first->chunks()) {
    const auto a = first->chunk(chunk.id).bytes, b = (*again)->chunk(chunk.id).bytes;
    EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end()));
  }
}

TEST_F(StoreTest, RemarksOnTheFileAreToldEachTimeItIsOpened) {
  const std::string grid = "ncols 3\nnrows 2\nxllcorner 900\nyllcorner 900\ncellsize 1\n1 2 3\n4 5 6\n";
  const auto made = open_or_fail(folder_.write("a.asc", grid), options_);
  const auto found = open_or_fail(folder_.write("b.asc", grid), options_);
  ASSERT_TRUE(made && found);
  ASSERT_TRUE(found->info().from_cache);
  ASSERT_EQ(made->info().notes.size(), 1u);
  ASSERT_EQ(found->info().notes.size(), 1u);
  const std::string remark = ": does not say in what system its coordinates are";
  EXPECT_TRUE(made->info().notes[0].starts_with((folder_ / "a.asc") + remark)) << made->info().notes[0];
  EXPECT_TRUE(found->info().notes[0].starts_with((folder_ / "b.asc") + remark)) << found->info().notes[0];
}

TEST_F(StoreTest, KnowsFilesByContentAndOptions) {
  open_or_fail(path_, options_);
  fs::copy(path_, folder_ / "copy.ply");
  EXPECT_TRUE(open_or_fail(folder_ / "copy.ply", options_)->info().from_cache);
  folder_.write("copy.ply", ply_of(wavy_grid(41)));
  EXPECT_FALSE(open_or_fail(folder_ / "copy.ply", options_)->info().from_cache);
  MeshOptions other = options_;
  other.room_size_m = 2.0;
  EXPECT_FALSE(open_or_fail(path_, other)->info().from_cache);
  other.up = "-x";
  EXPECT_FALSE(open_or_fail(path_, other)->info().from_cache);
  EXPECT_EQ(store_files(), 4u);
}

TEST_F(StoreTest, AChangedMaterialLibraryMakesAnotherStore) {
  const std::string obj = folder_.write("a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n");
  folder_.write("a.mtl", "newmtl m\nKd 1 0 0\n");
  EXPECT_EQ(contents_of(*open_or_fail(obj, options_)).triangles.at(0)[0].colour, 0xff0000u);
  folder_.write("a.mtl", "newmtl m\nKd 0 1 0\n");
  EXPECT_EQ(contents_of(*open_or_fail(obj, options_)).triangles.at(0)[0].colour, 0x00ff00u);
}

// Any damage, in any part of the file, is noticed and repaired.
TEST_F(StoreTest, DamagedStoresAreMadeAnew) {
  const auto good = contents_of(*open_or_fail(path_, options_)).triangles.size();
  const fs::path file = store_file();
  const auto size = fs::file_size(file);
  const auto damage_and_open = [&](const std::string& what) {
    const auto store = open_or_fail(path_, options_);
    ASSERT_TRUE(store) << what;
    EXPECT_FALSE(store->info().from_cache) << what;
    EXPECT_EQ(contents_of(*store).triangles.size(), good) << what;
    EXPECT_EQ(fs::file_size(file), size) << what;
    EXPECT_TRUE(open_or_fail(path_, options_)->info().from_cache) << what;
  };
  for (uint64_t length : {uint64_t{0}, uint64_t{100}, uint64_t{4096}, uint64_t{8192}, uint64_t{size - 1}}) {
    fs::resize_file(file, length);
    damage_and_open(fmt::format("cut to {}", length));
  }
  // Magic, version, number of chunks, size, a count, bytes around the checksum, the table of contents, a chunk.
  for (uint64_t offset : {0, 8, 12, 16, 32, 100, 4096, 4104, 8192 + 4, 8192 + 5000}) {
    {
      std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
      stream.seekg(static_cast<long>(offset));
      const char byte = static_cast<char>(stream.get() ^ 0x40);
      stream.seekp(static_cast<long>(offset));
      stream.put(byte);
    }
    damage_and_open(fmt::format("byte {} changed", offset));
  }
}

// Chunks of a large store are checked when they are first used.
class LargeStoreTest : public StoreTest {
 protected:
  LargeStoreTest() {
    path_ = folder_.write("large.ply", ply_of(wavy_grid(200)));
    options_.checked_at_opening = 0;
    geometry::ChunkBytes chunk = open_or_fail(path_, options_)->chunk(kDamaged);
    std::fstream file(store_file(), std::ios::in | std::ios::out | std::ios::binary);
    const std::string content(std::istreambuf_iterator<char>(file), {});
    const size_t at = content.find({reinterpret_cast<const char*>(chunk.bytes.data()), chunk.bytes.size()}) + 5000;
    file.seekp(static_cast<long>(at)).put(static_cast<char>(content[at] ^ 0x40));
  }
  static void use(const MeshStore& store) {
    end_at_cut_off_files(1);
    store.chunk(kDamaged);
    _exit(0);
  }
  static constexpr ChunkId kDamaged{1};
  static constexpr const char* kTold =
      "^telesplat: .*\\.mesh: chunk 1 of the store is damaged; the next start makes the store anew\n$";
};

TEST_F(LargeStoreTest, ADamagedChunkIsNeverGivenAndItsStoreMadeAnew) {
  const auto damaged = open_or_fail(path_, options_);
  ASSERT_TRUE(damaged->info().from_cache);
  EXPECT_TRUE(geometry::decode_chunk(damaged->chunk(ChunkId{0}).bytes).ok());
  EXPECT_EXIT(use(*damaged), testing::ExitedWithCode(1), kTold);
  EXPECT_TRUE(store_file().empty());
  const auto again = open_or_fail(path_, options_);
  EXPECT_FALSE(again->info().from_cache);
  EXPECT_EQ(contents_of(*again).triangles.size(), 80'000u);
}

TEST_F(LargeStoreTest, OneThatFindsDamageLaterLeavesTheNewStore) {
  const auto damaged = open_or_fail(path_, options_);
  fs::remove(store_file());
  open_or_fail(path_, options_);
  EXPECT_EXIT(use(*damaged), testing::ExitedWithCode(1), kTold);
  EXPECT_TRUE(open_or_fail(path_, options_)->info().from_cache);
}

TEST_F(LargeStoreTest, InspectChecksAll) {
  const auto facts = inspect_store(store_file());
  ASSERT_FALSE(facts.ok());
  EXPECT_NE(facts.error().text.find("chunk 1 of the store is damaged"), std::string::npos) << facts.error().text;
}

TEST_F(StoreTest, FailedReadingLeavesNothingBehind) {
  const std::string whole = ply_of(wavy_grid(5));
  const std::string bad = folder_.write("bad.ply", whole.substr(0, whole.size() - 20));
  EXPECT_FALSE(open_mesh(bad, options_, nullptr).ok());
  EXPECT_EQ(store_files(), 0u);
  for (const auto& entry : fs::directory_iterator(options_.cache_dir)) EXPECT_NE(entry.path().extension(), ".part");
}

TEST_F(StoreTest, ManyOpenersAtOnceMakeOneGoodStore) {
  std::vector<std::shared_ptr<MeshStore>> stores(8);
  std::vector<std::thread> threads;
  for (auto& store : stores) threads.emplace_back([&] { store = open_or_fail(path_, options_); });
  for (auto& thread : threads) thread.join();
  size_t made = 0;
  for (const auto& store : stores) {
    ASSERT_TRUE(store);
    EXPECT_EQ(contents_of(*store).triangles.size(), 3200u);
    made += !store->info().from_cache;
  }
  EXPECT_EQ(made, 1u);  // the others waited for it
  EXPECT_EQ(store_files(), 1u);
}

TEST_F(StoreTest, GoesOnWithoutACacheThatCannotBeWritten) {
  options_.cache_dir = folder_.write("occupied", "a file, not a folder");
  const auto store = open_or_fail(path_, options_);
  ASSERT_TRUE(store);
  EXPECT_EQ(contents_of(*store).triangles.size(), 3200u);
}

TEST_F(StoreTest, RoomIsCheckedBeforeItIsTaken) {
  const std::string path = folder_.write("store", "");
  const auto file = Descriptor::open_file(path, O_RDWR);
  EXPECT_TRUE(check_room(file.get(), "a.ply", 1).ok());
  const Status s = check_room(file.get(), "a.ply", uint64_t{1} << 55);
  ASSERT_FALSE(s.ok());
  EXPECT_TRUE(s.error().text.starts_with("a.ply: its chunk store takes about 792634 TB, ")) << s.error().text;
  EXPECT_NE(s.error().text.find(fs::path(path).parent_path().string() + " has "), std::string::npos) << s.error().text;
}

TEST_F(StoreTest, WritesThroughNoLinks) {
  ASSERT_TRUE(open_or_fail(path_, options_));
  const std::string stem = store_file().replace_extension("").string();
  const std::string precious = folder_.write("precious", "mine");
  for (const char* name : {".part", ".used"}) {
    fs::remove(stem + name);
    fs::create_symlink(precious, stem + name);
  }
  ASSERT_TRUE(open_or_fail(path_, options_)) << "it is used again";
  EXPECT_EQ(fs::file_size(precious), 4u);
  fs::remove(stem + ".mesh");
  EXPECT_TRUE(open_or_fail(path_, options_)) << "it is made anew, or done without";
  EXPECT_EQ(fs::file_size(precious), 4u);
  fs::remove(stem + ".lock");
  fs::create_symlink(folder_ / "not-there", stem + ".lock");
  fs::remove(stem + ".mesh");
  EXPECT_TRUE(open_or_fail(path_, options_));
  EXPECT_FALSE(fs::exists(folder_ / "not-there"));
}

TEST_F(StoreTest, MappedChunksOutliveTheStoreAndItsFile) {
  auto store = open_or_fail(path_, options_);
  const geometry::ChunkBytes bytes = store->chunk(ChunkId{0});
  store.reset();
  fs::remove_all(options_.cache_dir);
  EXPECT_TRUE(geometry::decode_chunk(bytes.bytes).ok());
}

TEST_F(StoreTest, InspectSumsUp) {
  const auto facts = inspect_mesh(path_, options_, nullptr);
  ASSERT_TRUE(facts.ok());
  EXPECT_EQ(facts->file_bytes, fs::file_size(path_));
  EXPECT_EQ(facts->chunks, 1u);
  EXPECT_GT(facts->chunk_bytes, 3200u * 3);
  EXPECT_LT(facts->chunk_bytes, 3200u * 18);
  const std::string text = describe(*facts).table();
  for (const char* part : {"grid.ply: a mesh", "triangles    3200", "1681", "z (shaped like a terrain)", "computed"})
    EXPECT_NE(text.find(part), std::string::npos) << text;
  EXPECT_TRUE(is_mesh_file(path_));
}

}  // namespace
}  // namespace telesplat::data::test
