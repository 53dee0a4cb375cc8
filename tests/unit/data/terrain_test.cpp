// The terrain generator: exact counts, the same land for the same seed, and its result in a data server.
#include "tools/make_terrain/terrain.h"

#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <map>
#include <set>

#include "common/core/whole_file.h"
#include "tests/support/files/data_files.h"

namespace telesplat::terrain {
namespace {

using data::test::TempFolder;

struct Whole : Terrain {
  Whole(uint64_t triangles, uint64_t seed) : Terrain(triangles, seed) {}
  std::vector<Vertex> points = vertices(0, grid().vertex_rows());
  std::vector<Face> triangles = faces(0, grid().vertex_rows());
};

TEST(Terrain, HasExactlyTheTrianglesAskedFor) {
  for (uint64_t triangles : {2u, 4999u}) {
    const Whole land(triangles, 3);
    ASSERT_EQ(land.triangles.size(), triangles);
    std::vector<bool> used(land.points.size(), false);
    for (const Face& face : land.triangles) {
      glm::vec3 corner[3];
      for (int k = 0; k < 3; ++k) {
        const uint32_t v = face.vertex[k];
        ASSERT_LT(v, land.points.size());
        used[v] = true;
        const Vertex& p = land.points[v];
        corner[k] = {p.position[0], p.position[1], p.position[2]};
      }
      EXPECT_GT(glm::cross(corner[1] - corner[0], corner[2] - corner[0]).z, 0) << "faces down or is degenerate";
    }
    EXPECT_TRUE(std::all_of(used.begin(), used.end(), [](bool u) { return u; })) << triangles;
  }
}

TEST(Terrain, MayHaveMoreTrianglesThanFitIntoMemory) {
  const Terrain land(kMaxTriangles, 3);
  const uint64_t rows = land.grid().vertex_rows(), last = land.grid().vertices() - 1;
  ASSERT_LT(last, uint64_t{1} << 31);
  EXPECT_EQ(+land.faces(rows - 2, rows).back().vertex[0], last - (land.grid().columns + 1));
  EXPECT_FLOAT_EQ(land.vertices(rows - 1, rows).back().position[1], 14000);
}

std::string ply_of(const Terrain& land, uint64_t band_rows) {
  const TempFolder folder;
  EXPECT_TRUE(write_ply(land, folder / "land.ply", kGoOn, band_rows).ok());
  return *read_whole(folder / "land.ply", ply_bytes(land.grid()));
}

TEST(Terrain, DependsOnTheSeedAloneAndNotOnTheBands) {
  const Terrain land(3001, 5);
  const std::string file = ply_of(land, 1000);
  EXPECT_EQ(file.size(), ply_bytes(land.grid()));
  for (uint64_t band_rows : {1, 7, 39}) EXPECT_TRUE(ply_of(land, band_rows) == file) << band_rows;
  EXPECT_TRUE(ply_of(Terrain(3001, 5), 64) == file);
  EXPECT_FALSE(ply_of(Terrain(3001, 6), 64) == file);
}

TEST(Terrain, IsACalderaWithALake) {
  const Whole land(100000, 7);
  std::map<float, int> heights;
  std::set<int> colours;
  for (const Vertex& v : land.points) {
    const float z = v.position[2];
    ASSERT_TRUE(std::isfinite(z));
    ++heights[z], colours.insert(v.colour[0] << 16 | v.colour[1] << 8 | v.colour[2]);
  }
  const auto lake = std::ranges::max_element(heights, {}, [](const auto& height) { return height.second; });
  EXPECT_FLOAT_EQ(lake->first, 1883.0f);  // the lake's level, and flat
  const double share = static_cast<double>(lake->second) / static_cast<double>(land.points.size());
  EXPECT_NEAR(share, 0.2, 0.15);
  EXPECT_LT(heights.begin()->first, 1500);
  EXPECT_GT(heights.rbegin()->first, 2200);
  EXPECT_LT(heights.rbegin()->first, 3500);
  int blue = 0;
  for (const Vertex& v : land.points) blue += v.position[2] == lake->first && v.colour[2] > v.colour[0];
  EXPECT_GT(blue, 0.99 * lake->second);
  EXPECT_GT(colours.size(), 1000u);
}

TEST(Terrain, ItsFileOpensAsAMeshThatStandsOnZ) {
  const TempFolder folder;
  const Terrain land(3001, 2);
  ASSERT_TRUE(write_ply(land, folder / "land.ply").ok());
  const auto store = data::test::open_or_fail(folder / "land.ply", data::test::plain_options("auto"));
  ASSERT_TRUE(store);
  EXPECT_EQ(store->info().triangles, 3001u);
  EXPECT_EQ(store->info().vertices, land.grid().vertices());
  EXPECT_EQ(store->info().up, "z");
  EXPECT_TRUE(store->info().had_colours);
}

TEST(Terrain, ItsChunksAndTheirLevelsAreSmall) {
  const TempFolder folder;
  ASSERT_TRUE(write_ply(Terrain(200'000, 7), folder / "land.ply").ok());
  const auto store = data::test::open_or_fail(folder / "land.ply", data::test::plain_options("auto"));
  ASSERT_TRUE(store);
  EXPECT_GT(store->chunks().size(), store->leaves().size());
  uint64_t bytes = 0;
  for (const geometry::ChunkInfo& chunk : store->chunks()) bytes += chunk.bytes;
  EXPECT_LT(bytes, 18 * store->info().triangles);
}

TEST(Terrain, WhatIsNotWrittenWholeLeavesNoFile) {
  const TempFolder folder;
  const Terrain land(3001, 2);
  const std::string path = folder / "land.ply", missing = folder / "missing/land.ply";
  const auto refusal = [](const Status& status) { return status.ok() ? "" : status.error().text; };
  for (const Status& s : {write_ply(land, missing), check_room(missing, 1)})
    EXPECT_EQ(refusal(s), missing + ": cannot be written: No such file or directory");
  EXPECT_EQ(refusal(check_room(path, 1)), "");
  EXPECT_TRUE(refusal(check_room(path, uint64_t{1} << 60)).starts_with(path + ": needs 1152921504.61 GB, its disk"));
  const Progress stops = [](double fraction) { return fraction < 0.95; };
  EXPECT_EQ(refusal(write_ply(land, path, stops, 4)), path + ": cannot be written: Operation canceled");
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{30'000, before.rlim_max};  // as on a full disk
  setrlimit(RLIMIT_FSIZE, &small);
  const Status full = write_ply(land, path);
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(refusal(full), path + ": cannot be written: File too large");
  EXPECT_TRUE(std::filesystem::is_empty(folder / ""));
}

}  // namespace
}  // namespace telesplat::terrain
