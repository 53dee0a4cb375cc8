#include "services/data/base/elevation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace telesplat::data {
namespace {

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();

ElevationRaster raster(int width, int height, auto z) {
  ElevationRaster r{width, height, {100, 2000}, {30, 0}, {0, -30}, true};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) r.heights.push_back(z(x, y));
  return r;
}

TEST(Elevation, StandsEastNorthAndUp) {
  const auto mesh = elevation_mesh(raster(4, 3, [](int x, int y) { return float(10 * x + y); }), {}, "a");
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->positions.size(), 12u);
  EXPECT_EQ(mesh->indices.size(), 3u * 2 * 2 * 3);
  EXPECT_EQ(mesh->positions[0], glm::dvec3(100, 2000, 0));
  EXPECT_EQ(mesh->positions[7], glm::dvec3(190, 1970, 31));
  // Every triangle faces up.
  for (size_t i = 0; i < mesh->indices.size(); i += 3) {
    const auto p = [&](size_t k) { return mesh->positions[mesh->indices[i + k]]; };
    EXPECT_GT(glm::cross(p(1) - p(0), p(2) - p(0)).z, 0);
  }
  EXPECT_TRUE(validate_mesh(*mesh, "a"));
}

TEST(Elevation, StandsAsItsGridIsTurnedAndMirrored) {
  auto turned = raster(4, 3, [](int x, int y) { return float(10 * x + y); });
  for (const auto& [row, column] :
       {std::pair{glm::dvec2(24, 18), glm::dvec2(18, -24)},    // by 37 degrees
        std::pair{glm::dvec2(30, 0), glm::dvec2(0, 30)},       // its first row in the south
        std::pair{glm::dvec2(-30, 0), glm::dvec2(0, -30)}}) {  // its first column in the east
    turned.along_row = row, turned.along_column = column;
    const auto mesh = elevation_mesh(turned, {}, "a");
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->positions[7], glm::dvec3(glm::dvec2(100, 2000) + 3.0 * row + column, 31));
    for (size_t i = 0; i < mesh->indices.size(); i += 3) {
      const auto p = [&](size_t k) { return mesh->positions[mesh->indices[i + k]]; };
      EXPECT_GT(glm::cross(p(1) - p(0), p(2) - p(0)).z, 0);
    }
  }
}

TEST(Elevation, IsScaledUpwards) {
  const auto flat = raster(8, 8, [](int x, int) { return float(x); });
  const auto three = elevation_mesh(flat, {.z_scale = 3}, "a");
  ASSERT_TRUE(three);
  EXPECT_EQ(three->positions[5].z, 15);
  // Without a place on earth the size of a pixel is unknown: the relief becomes a seventh of the longer side.
  auto unplaced = flat;
  unplaced.georeferenced = false;
  unplaced.along_row = {1, 0}, unplaced.along_column = {0, -1};
  const auto automatic = elevation_mesh(unplaced, {}, "a");
  ASSERT_TRUE(automatic);
  EXPECT_NEAR(automatic->positions[7].z - automatic->positions[0].z, 8.0 / 7, 1e-6);
  EXPECT_FALSE(elevation_mesh(flat, {.z_scale = std::nan("")}, "a"));
}

TEST(Elevation, LeavesOutWhatHasNoData) {
  const auto holed = raster(5, 5, [](int x, int y) { return x == 2 && y == 2 ? kVoid : float(x); });
  const auto mesh = elevation_mesh(holed, {}, "a");
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->positions.size(), 24u);
  EXPECT_EQ(mesh->indices.size(), 3u * (2 * 12 + 4));  // twelve whole cells, four with three corners
  for (const auto& p : mesh->positions) EXPECT_TRUE(std::isfinite(p.z));
  const auto nothing = elevation_mesh(raster(5, 5, [](int, int) { return kVoid; }), {}, "name");
  ASSERT_FALSE(nothing);
  EXPECT_NE(nothing.error().text.find("name"), std::string::npos);
  const auto apart = elevation_mesh(raster(4, 4, [](int x, int y) { return (x + y) % 2 ? kVoid : 1.f; }), {}, "a");
  EXPECT_FALSE(apart);
  EXPECT_FALSE(elevation_mesh(raster(1, 9, [](int, int) { return 1.f; }), {}, "a"));
}

TEST(Elevation, ColoursByHeightOrTexture) {
  const auto coast = raster(20, 20, [](int x, int) { return float(50 * (x - 5)); });
  const auto mesh = elevation_mesh(coast, {}, "a");
  ASSERT_TRUE(mesh);
  const auto blue = [](uint32_t c) { return (c & 255) > (c >> 16 & 255); };
  EXPECT_TRUE(blue(mesh->colours[0]));        // under the sea
  EXPECT_TRUE(blue(mesh->colours[5]));        // at its level
  EXPECT_FALSE(blue(mesh->colours[8]));       // low land
  EXPECT_GT(mesh->colours[19] & 255, 0xd0u);  // snow
  auto draped = coast;
  draped.colours.assign(400, 0x123456);
  const auto with = elevation_mesh(draped, {}, "a");
  ASSERT_TRUE(with);
  EXPECT_EQ(with->colours[37], 0x123456u);
}

}  // namespace
}  // namespace telesplat::data
