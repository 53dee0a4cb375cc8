// A viewer as a tile of a display wall: its camera is its part of the whole's, to the last ray.
#include <gtest/gtest.h>

#include "client/viewer/display/headless_surface.h"
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
  whole.span.duration_s = 10;
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

// The front edges of a cube s times 1 m across are seen s / 2 above the middle: (1.3 - s / 2) of 0.7 times 0.15 m.
TEST(Wall, OneInTheRoomTellsTheRoomSizeThatItShowsWhole) {
  const auto wall = wall::parse_wall(
      "[wall]\nname = \"desk\"\nposition = [0.0, 0.0, 0.6]\n[head]\nposition = [0.0, 0.0, 0.7]\n"
      "[[screen]]\nposition = [0.0, 0.0, 0.0]\nsize = [0.6, 0.3]\nresolution = [160, 80]\n",
      "desk.toml");
  ASSERT_TRUE(wall.ok()) << wall.error().text;
  const geometry::Pose head{{0, 0, 1.3}, glm::dquat(1, 0, 0, 0)};
  const geometry::Box cube{glm::vec3(-0.5f), glm::vec3(0.5f)};
  const double share = 0.15 * 1.3 / 0.7 / (0.5 + 0.075 / 0.7);
  EXPECT_NEAR(wall::shown_share(*wall, head, cube), share, 1e-5);
  EXPECT_EQ(wall::shown_share(*wall, head, {cube.lo * float(share * 0.999), cube.hi * float(share * 0.999)}), 1);

  DisplayOptions o;
  o.wall.described = std::make_shared<const wall::Wall>(*wall);
  std::vector<std::string> told;
  HeadlessSurface surface(o, {.eye = head.position_room}, [&](const std::string& line) { told.push_back(line); });
  ShownScene scene;
  scene.box_room = cube;
  surface.on_scene(scene);
  surface.on_scene(scene);
  EXPECT_EQ(told, std::vector<std::string>{"the screens of desk do not show all of the data to a head where it begins; "
                                           "with --room-size 0.454 they do"});
}

}  // namespace
}  // namespace telesplat::viewer
