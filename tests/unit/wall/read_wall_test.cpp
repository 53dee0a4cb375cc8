// Descriptions of walls: the screens that they describe, and the message for each mistake.
#include <gtest/gtest.h>

#include <filesystem>
#include <glm/geometric.hpp>
#include <string>

#include "client/wall/screen_camera.h"
#include "client/wall/wall.h"

namespace telesplat::wall {
namespace {

const std::string kWalls = std::string(TELESPLAT_WALLS) + "/";

std::string refusal(const std::string& text) {
  const auto wall = parse_wall(text, "lab.toml");
  return wall ? "" : wall.error().text;
}

constexpr const char* kHead = "[head]\nposition = [0, 0, 1]\n";

TEST(ReadWall, GridsStandByRowsFromTheUpperLeft) {
  const auto wall = parse_wall(std::string(kHead) +
                                   "[[planar]]\ncolumns = 3\nrows = 2\nsize = [0.4, 0.3]\nresolution = [160, 120]\n"
                                   "bezel = [0.01, 0.02, 0.03, 0.04]\nscreens_per_node = 2\n",
                               "lab.toml");
  ASSERT_TRUE(wall.ok()) << wall.error().text;
  EXPECT_EQ(wall->name, "lab");
  ASSERT_EQ(wall->screens.size(), 6u);
  EXPECT_EQ(wall->nodes(), 3);
  EXPECT_EQ(wall->screens_of(1), (std::vector<int>{2, 3}));
  const auto& first = wall->screens[0].pose.position_room;
  const auto& last = wall->screens[5].pose.position_room;
  // Middles lie 0.4 + 0.01 + 0.02 apart, beside the grid's middle by half of the difference of the bezels.
  EXPECT_NEAR(first.x, -0.43 - 0.005, 1e-12);
  EXPECT_NEAR(first.y, 0.185 - 0.005, 1e-12);
  EXPECT_NEAR(last.x, 0.43 - 0.005, 1e-12);
  EXPECT_NEAR(last.y, -0.185 - 0.005, 1e-12);
  EXPECT_EQ(wall->screens[4].name, "planar, row 2, column 2");
  EXPECT_TRUE(is_plane(*wall));
}

TEST(ReadWall, ColumnsOfAnArcFaceItsAxisAndTouch) {
  const auto wall = read_wall(kWalls + "cylinder-7x5.toml");
  ASSERT_TRUE(wall.ok()) << wall.error().text;
  ASSERT_EQ(wall->screens.size(), 35u);
  EXPECT_EQ(wall->nodes(), 18);
  EXPECT_FALSE(is_plane(*wall));
  for (const Screen& s : wall->screens) {
    EXPECT_EQ(s.width, 1600);
    EXPECT_EQ(s.height, 1200);
    const glm::dvec3 normal = s.pose.orientation * glm::dvec3(0, 0, 1);
    const glm::dvec3 inwards(-s.pose.position_room.x, 0, -s.pose.position_room.z);
    EXPECT_NEAR(glm::length(inwards), 1.5, 1e-12);
    EXPECT_NEAR(glm::dot(normal, inwards) / 1.5, 1, 1e-12) << s.name;
  }
  // The outer edge of a panel is that of its neighbour.
  const auto edge = [](const Screen& s, double side) {
    return s.pose.position_room + s.pose.orientation * glm::dvec3(side * (s.width_m / 2 + s.bezel.left), 0, 0);
  };
  EXPECT_LT(glm::distance(edge(wall->screens[2], 1), edge(wall->screens[3], -1)), 1e-12);
  EXPECT_LT(wall->screens[0].pose.position_room.x, 0) << "the first column is the left one";
  EXPECT_GT(wall->screens[0].pose.position_room.y, 0) << "the first row is the upper one";
}

TEST(ReadWall, ShippedWallsAreWalls) {
  int walls = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kWalls)) {
    const auto wall = read_wall(entry.path().string());
    EXPECT_TRUE(wall.ok()) << (wall ? "" : wall.error().text);
    ++walls;
  }
  EXPECT_EQ(walls, 4);
  const auto personal = read_wall(kWalls + "personal.toml");
  EXPECT_EQ(personal->screens[0].sampling, (std::pair{1024, 640}));
}

TEST(ReadWall, MistakesAreToldWithFileKeyValueAndLimit) {
  const std::string panel = "size = [0.4, 0.3]\nresolution = [160, 120]\n", planar = "[[planar]]\n";
  const struct {
    std::string text, told;
  } cases[] = {
      {"", "lab.toml: [head] is missing"},
      {kHead, "lab.toml: has no screens"},
      {std::string(kHead) + "[[planer]]\n" + panel, "lab.toml:3: planer is none of"},
      {std::string(kHead) + "[planar]\n" + panel, "lab.toml:3: planar is no list of tables"},
      {std::string(kHead) + planar + "resolution = [160, 120]\n", "[[planar]] 1 size: is missing"},
      {std::string(kHead) + planar + "size = [0.001, 0.3]\nresolution = [160, 120]\n",
       "lab.toml:4: [[planar]] 1 size: 0.001 is outside 0.01..50"},
      {std::string(kHead) + planar + "size = [0.4]\nresolution = [160, 120]\n", "size: is not a list of 2 numbers"},
      {std::string(kHead) + planar + "size = [0.4, \"a\"]\nresolution = [160, 120]\n", "is not a list of 2 numbers"},
      {std::string(kHead) + planar + "size = [0.4, 0.3]\nresolution = [160, 20000]\n",
       "resolution: 20000 is outside 16..16384"},
      {std::string(kHead) + planar + "size = [0.4, 0.3]\nresolution = [160, 20.5]\n", "are no whole numbers"},
      {std::string(kHead) + planar + panel + "colums = 2\n",
       "lab.toml:6: [[planar]] 1 colums: is no key here; did you "
       "mean columns?"},
      {std::string(kHead) + planar + panel + "columns = 2.5\n", "columns: 2.5 is no whole number"},
      {std::string(kHead) + planar + panel + "columns = 64\nrows = 5\n", "columns: 64 x 5 screens, limit 256"},
      {std::string(kHead) + planar + panel + "centre = [0, 0, 2]\n", "is -1.000 m before the screen planar, row 1"},
      {std::string(kHead) + planar + panel + "bezel = 2\n", "bezel: 2 is outside 0..1"},
      {std::string(kHead) + "[[cylindrical]]\n" + panel, "[[cylindrical]] 1 radius: is missing"},
      {std::string(kHead) + "[[cylindrical]]\nradius = 2\ncolumns = 64\n" + panel, "are more than a whole turn"},
      {std::string(kHead) + "[[cylindrical]]\nradius = 2\ncolumns = 3\ncolumn_angle = 3\n" + panel, "overlap below"},
      {std::string(kHead) + "[[screen]]\n" + panel, "[[screen]] 1 position: is missing"},
      {std::string(kHead) + "[[screen]]\nposition = [0, 0, 0]\nnode = 3\n" + panel, "none may be left out"},
      {"[wall]\nanchor = \"ceiling\"\n" + std::string(kHead) + planar + panel,
       "anchor: \"ceiling\" is not room or head"},
      {"[wall]\nanchor = \"head\"\nposition = [0, 0, 1]\n" + std::string(kHead) + planar + panel,
       "[wall] position: a wall with anchor = \"head\" is where the head takes it"},
      {"[head\n", "lab.toml:1: "},
  };
  for (const auto& c : cases) {
    const std::string told = refusal(c.text);
    EXPECT_NE(told.find(c.told), std::string::npos) << c.text << "-> " << told;
    EXPECT_EQ(told.find("lab.toml"), 0u) << told;
  }
  EXPECT_NE(read_wall("/none/such.toml").error().text.find("/none/such.toml: cannot be read"), std::string::npos);
}

TEST(ReadWall, IsScaledInPixelsAlone) {
  const auto wall = read_wall(kWalls + "personal.toml");
  const Wall small = scaled(*wall, 0.1);
  EXPECT_EQ(small.screens[0].width, 256);
  EXPECT_EQ(small.screens[0].height, 160);
  EXPECT_EQ(small.screens[0].sampling, (std::pair{102, 64}));
  EXPECT_EQ(small.screens[0].width_m, wall->screens[0].width_m);
}

}  // namespace
}  // namespace telesplat::wall
