// Real meshes of every format, if this machine has them.
#include <cstdlib>

#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

std::string data_folder() {
  if (const char* folder = std::getenv("TELESPLAT_DATA")) return folder;
  const char* home = std::getenv("HOME");
  return std::string(home ? home : "") + "/.cache/telesplat-data";
}

struct RealFile {
  std::string name, format;
  uint64_t triangles;  // in the file, degenerate ones included
  bool normals, colours;
  std::string up;
};

class RealFiles : public testing::TestWithParam<RealFile> {};

TEST_P(RealFiles, OpenWithAllTheirTriangles) {
  const RealFile& expected = GetParam();
  const std::string path = data_folder() + "/" + expected.name;
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there (set TELESPLAT_DATA)";
  const auto store = open_or_fail(path, plain_options("auto"));
  ASSERT_TRUE(store);
  const MeshStoreInfo& info = store->info();
  EXPECT_EQ(info.format, expected.format);
  EXPECT_EQ(info.triangles + info.degenerate_dropped, expected.triangles);
  EXPECT_EQ(info.had_normals, expected.normals);
  EXPECT_EQ(info.had_colours, expected.colours);
  EXPECT_EQ(info.up, expected.up);
  const glm::vec3 size = info.box_room.size();
  EXPECT_NEAR(std::max({size.x, size.y, size.z}), 0.8, 1e-6);
  uint64_t triangles = 0;
  for (const auto& chunk : store->leaves()) {
    EXPECT_TRUE(geometry::decode_chunk(store->chunk(chunk.id).bytes).ok());
    triangles += chunk.triangles;
  }
  EXPECT_EQ(triangles, info.triangles);
}

INSTANTIATE_TEST_SUITE_P(All, RealFiles,
                         testing::Values(RealFile{"meshes/colorado-5760k.ply", "ply", 5760000, false, true, "z"},
                                         RealFile{"meshes/head-t1-4100k.ply", "ply", 4099618, false, false, "z"},
                                         RealFile{"meshes/crater-lake-srtm3-2880k.ply", "ply", 2880000, false, true,
                                                  "z"},
                                         RealFile{"meshes/alderson-bone-718k.ply", "ply", 717558, false, false, "z"},
                                         RealFile{"formats/stanford-bunny.ply", "ply", 69451, false, false, "y"},
                                         RealFile{"formats/lucy-100k.ply", "ply", 99970, false, false, "y"},
                                         RealFile{"formats/nefertiti.obj", "obj", 99938, false, false, "y"},
                                         RealFile{"formats/grey-nurse-shark.stl", "stl", 49702, false, false, "y"},
                                         RealFile{"formats/camelhead.off", "off", 22704, false, false, "y"},
                                         RealFile{"formats/cranium-bone.vtp", "vtp", 399757, true, false, "z"},
                                         RealFile{"formats/space-exploration.glb", "gltf", 50003, true, true, "y"}),
                         [](const auto& info) {
                           auto n = info.param.name;
                           std::replace_if(
                               n.begin(), n.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); },
                               '_');
                           return n;
                         });

TEST(RealRasters, BecomeColouredHeightFields) {
  for (const char* name : {"formats/N42W123.hgt", "formats/andes-srtm3.tif"}) {
    const std::string path = data_folder() + "/" + name;
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there (set TELESPLAT_DATA)";
    const auto store = open_mesh(path, plain_options("auto"), nullptr);
    ASSERT_TRUE(store.ok()) << store.error().text;
    const auto& info = (*store)->info();
    EXPECT_EQ(info.format, "raster");
    EXPECT_EQ(info.up, "z");
    EXPECT_TRUE(info.had_colours);
    EXPECT_GT(info.triangles, 2'500'000u);
    EXPECT_LE(info.triangles, 2u * 1200 * 1200);
    // A tile of one degree: 111 km from south to north, mountains of some thousand metres.
    const auto size = info.box_data.size();
    EXPECT_NEAR(size.y, 110'574, 300);
    EXPECT_GT(size.x, 75'000);
    EXPECT_GT(size.z, 1000);
    EXPECT_LT(size.z, 8000);
  }
}

TEST(RealCache, FiveMillionTrianglesComeFromTheStoreTheSecondTime) {
  const std::string path = data_folder() + "/meshes/colorado-5760k.ply";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there (set TELESPLAT_DATA)";
  const TempFolder folder;
  MeshOptions options;
  options.cache_dir = folder / "cache";
  const auto first = open_or_fail(path, options);
  ASSERT_TRUE(first);
  EXPECT_FALSE(first->info().from_cache);
  const auto again = open_or_fail(path, options);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->info().from_cache);
  EXPECT_EQ(again->info().triangles, first->info().triangles);
  EXPECT_EQ(again->chunks(), first->chunks());
}

}  // namespace
}  // namespace telesplat::data::test
