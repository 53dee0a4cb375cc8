// A wall laid flat: places of its pictures in the picture of all.
#include <gtest/gtest.h>

#include "client/wall/screen_camera.h"

namespace telesplat::wall {
namespace {

Wall grid(const std::string& more) {
  const auto wall = parse_wall("[head]\nposition = [0, 0, 1]\n" + more, "lab.toml");
  EXPECT_TRUE(wall.ok()) << (wall ? "" : wall.error().text);
  return *wall;
}

TEST(Unrolled, PlanesAreTiledWithoutGaps) {
  const auto flat = unrolled(grid("[[planar]]\ncolumns = 3\nrows = 2\nsize = [0.4, 0.3]\nresolution = [160, 120]\n"));
  ASSERT_TRUE(flat.ok()) << flat.error().text;
  EXPECT_EQ(flat->width, 480);
  EXPECT_EQ(flat->height, 240);
  for (int i = 0; i < 6; ++i)
    EXPECT_EQ(flat->places[size_t(i)], (geometry::Rect{i % 3 * 160, i / 3 * 120, 160, 120})) << i;
}

TEST(Unrolled, BezelsAreGaps) {
  const auto flat = unrolled(
      grid("[[planar]]\ncolumns = 2\nsize = [0.4, 0.3]\nresolution = [160, 120]\nbezel = [0.01, 0.0, 0.0, 0.0]\n"));
  ASSERT_TRUE(flat.ok());
  EXPECT_EQ(flat->width, 324);  // a pixel is 2.5 mm
  EXPECT_EQ(flat->places[1].x, 164);
}

TEST(Unrolled, ArcsBecomeRowsAndColumns) {
  const auto flat =
      unrolled(grid("[[cylindrical]]\nradius = 1\ncentre = [0, 0, 0.5]\ncolumns = 3\nrows = 2\nsize = [0.4, 0.3]\n"
                    "resolution = [160, 120]\n"));
  ASSERT_TRUE(flat.ok());
  EXPECT_EQ(flat->width, 480);
  EXPECT_EQ(flat->places[5], (geometry::Rect{320, 120, 160, 120}));
}

TEST(Unrolled, AWallLargerThanAPictureIsRefused) {
  const auto flat = unrolled(grid("[[planar]]\ncolumns = 8\nsize = [0.4, 0.3]\nresolution = [4000, 3000]\n"));
  ASSERT_FALSE(flat.ok());
  EXPECT_NE(flat.error().text.find("the wall lab unrolled has 32000x3000 pixels, limit 16384"), std::string::npos)
      << flat.error().text;
}

}  // namespace
}  // namespace telesplat::wall
