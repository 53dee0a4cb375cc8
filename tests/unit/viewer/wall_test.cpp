// A viewer as a tile of a display wall: its camera is its part of the whole's, to the last ray.
#include <gtest/gtest.h>

#include "client/viewer/display/headless_surface.h"
#include "client/viewer/display/title_line.h"
#include "client/viewer/display/wall.h"

namespace telesplat::viewer {
namespace {

TEST(Wall, IsNamedByColumnsAndRows) {
  EXPECT_EQ(parse_wall("3x2").value(), (WallLayout{3, 2}));
  for (const char* bad : {"", "3", "x2", "3x", "0x2", "2x0", "-1x2", "17x1", "1x17", "3x2x1", "3 x2", "axb"})
    EXPECT_FALSE(parse_wall(bad).ok()) << bad;
}

TEST(Wall, TilesSeeTogetherWhatTheWholeSees) {
  DisplayOptions whole;
  whole.width = 3 * 80;
  whole.height = 2 * 50;
  whole.duration_s = 10;
  const HeadMovement movement{.recorded = std::make_shared<const geometry::Trajectory>(geometry::Trajectory::orbit())};
  Look look;
  HeadlessSurface all(whole, movement);
  const geometry::Camera reference = all.begin_frame(0, 3.5, look);
  for (int tile = 0; tile < 6; ++tile) {
    DisplayOptions part = whole;
    part.width = 80;
    part.height = 50;
    part.wall = {3, 2, tile};
    HeadlessSurface surface(part, movement);
    const geometry::Camera camera = surface.begin_frame(0, 3.5, look);
    ASSERT_TRUE(geometry::validate(camera).ok());
    EXPECT_EQ(camera.width, 80);
    EXPECT_EQ(camera.height, 50);
    const int x0 = tile % 3 * 80, y0 = tile / 3 * 50;
    for (const auto& [x, y] : {std::pair(0.5, 0.5), {79.5, 0.5}, {40.0, 49.5}, {0.0, 50.0}}) {
      const glm::dvec3 a = camera.unproject(x, y, 1), b = reference.unproject(x0 + x, y0 + y, 1);
      EXPECT_LT(glm::distance(a, b), 1e-14) << "tile " << tile;
    }
  }
}

TEST(Wall, ADisplayThatIsNoneShowsTheWhole) {
  const geometry::Camera whole = geometry::make_camera({}, 80, 640, 400);
  EXPECT_EQ(tile_of(whole, {}), whole);
}

TEST(TitleLine, CountsWhatIsDrawn) {
  TitleLine line;
  LiveFigures f{.now_s = 1, .scene = "bonsai", .frames = 1};
  line.update(f);
  f.now_s = 2;
  f.points_drawn = 12'310'000;
  f.points_cached = 2'100'000;
  f.drawn_name = "samples";
  f.cached_name = " pixels";
  const auto text = line.update(f);
  ASSERT_TRUE(text);
  EXPECT_NE(text->find("12.31 M samples drawn, 2.10 M pixels cached"), std::string::npos) << *text;
}

}  // namespace
}  // namespace telesplat::viewer
