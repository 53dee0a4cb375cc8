// The terrain generator: exact counts, the same land for the same seed, and its result in a data server.
#include "tools/make_terrain/terrain.h"

#include <map>
#include <set>

#include "tests/support/files/data_files.h"

namespace telesplat::terrain {
namespace {

using data::test::TempFolder;

TEST(Terrain, HasExactlyTheTrianglesAskedFor) {
  for (uint64_t triangles : {2u, 4999u}) {
    const Terrain land = make_terrain(triangles, 3);
    ASSERT_EQ(land.indices.size(), 3 * triangles);
    ASSERT_EQ(land.colours.size(), land.positions.size());
    std::vector<bool> used(land.positions.size(), false);
    for (size_t t = 0; t < land.indices.size(); t += 3) {
      const uint32_t* v = &land.indices[t];
      for (int k = 0; k < 3; ++k) {
        ASSERT_LT(v[k], land.positions.size());
        used[v[k]] = true;
      }
      const glm::vec3 a = land.positions[v[0]], b = land.positions[v[1]], c = land.positions[v[2]];
      EXPECT_GT(glm::cross(b - a, c - a).z, 0)
          << "triangle " << t / 3 << " of " << triangles << " faces down or is degenerate";
    }
    EXPECT_TRUE(std::all_of(used.begin(), used.end(), [](bool u) { return u; })) << triangles;
  }
}

TEST(Terrain, DependsOnTheSeedAlone) {
  const Terrain a = make_terrain(2000, 5), b = make_terrain(2000, 5), c = make_terrain(2000, 6);
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.colours, b.colours);
  EXPECT_NE(a.positions, c.positions);
}

TEST(Terrain, IsACalderaWithALake) {
  const Terrain land = make_terrain(100000, 7);
  std::map<float, int> heights;
  float lowest = 1e9f, highest = 0;
  for (const auto& p : land.positions) {
    ASSERT_TRUE(std::isfinite(p.z));
    ++heights[p.z];
    lowest = std::min(lowest, p.z), highest = std::max(highest, p.z);
  }
  const auto lake = std::max_element(heights.begin(), heights.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  EXPECT_FLOAT_EQ(lake->first, 1883.0f);  // the lake's level, and flat
  const double share = static_cast<double>(lake->second) / static_cast<double>(land.positions.size());
  EXPECT_GT(share, 0.05);
  EXPECT_LT(share, 0.35);
  EXPECT_LT(lowest, 1500);
  EXPECT_GT(highest, 2200);
  EXPECT_LT(highest, 3500);
  int blue = 0, water = 0;
  std::set<uint32_t> colours(land.colours.begin(), land.colours.end());
  for (size_t i = 0; i < land.positions.size(); ++i)
    if (land.positions[i].z == lake->first) ++water, blue += (land.colours[i] & 255) > (land.colours[i] >> 16);
  EXPECT_GT(blue, 0.99 * water);
  EXPECT_GT(colours.size(), 1000u);
}

TEST(Terrain, ItsFileOpensAsAMeshThatStandsOnZ) {
  const TempFolder folder;
  const Terrain land = make_terrain(3001, 2);
  ASSERT_TRUE(write_ply(land, folder / "land.ply").ok());
  EXPECT_FALSE(std::filesystem::exists(folder / "land.ply.part"));
  auto options = data::test::plain_options("auto");
  const auto store = data::test::open_or_fail(folder / "land.ply", options);
  ASSERT_TRUE(store);
  EXPECT_EQ(store->info().triangles, 3001u);
  EXPECT_EQ(store->info().vertices, land.positions.size());
  EXPECT_EQ(store->info().up, "z");
  EXPECT_TRUE(store->info().had_colours);
  const auto refused = write_ply(land, folder / "missing/land.ply");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().text.find("missing/land.ply"), std::string::npos);
}

}  // namespace
}  // namespace telesplat::terrain
