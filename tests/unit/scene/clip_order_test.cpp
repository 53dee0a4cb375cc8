#include "common/scene/clip_order.h"

#include <gtest/gtest.h>

#include <random>

namespace telesplat::scene {
namespace {

const Placement kShelf = placement_of(glm::dmat3(glm::dvec3(1, 0, 0), glm::dvec3(0, 0, -1), glm::dvec3(0, 1, 0)),
                                      {{10, 20, 30}, {50, 40, 60}}, {{-0.4f, -0.3f, -0.2f}, {0.4f, 0.3f, 0.2f}});

geometry::Clip placed(const char* text) {
  const auto order = parse_clip(text);
  EXPECT_TRUE(order) << (order ? "" : order.error().text);
  if (!order) return {};
  const auto clip = place_clip(*order, kShelf);
  EXPECT_TRUE(clip) << (clip ? "" : clip.error().text);
  return clip ? *clip : geometry::Clip{};
}

// An order in the data's coordinates cuts the right points of the room, wherever the data stand there.
TEST(ClipOrder, IsMeantInTheDatasOwnCoordinates) {
  struct Case {
    const char* text;
    bool (*keeps)(const glm::dvec3& p);
  };
  const Case cases[] = {
      {"plane x>=25", [](const glm::dvec3& p) { return p.x >= 25; }},
      {"plane y <= 30", [](const glm::dvec3& p) { return p.y <= 30; }},
      {"plane z>=50%", [](const glm::dvec3& p) { return p.z >= 45; }},
      {"plane z<=10%", [](const glm::dvec3& p) { return p.z <= 33; }},
      {"plane 1,1,-2,3", [](const glm::dvec3& p) { return p.x + p.y - 2 * p.z >= 3; }},
      {"box 20,25,0%,30,35,50%",
       [](const glm::dvec3& p) { return p.x >= 20 && p.x <= 30 && p.y >= 25 && p.y <= 35 && p.z >= 30 && p.z <= 45; }},
      {"plane x>=25; plane y>=22", [](const glm::dvec3& p) { return p.x >= 25 && p.y >= 22; }},
      {"off", [](const glm::dvec3&) { return true; }}};
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const Case& c : cases) {
    const geometry::Clip clip = placed(c.text);
    for (int i = 0; i < 500; ++i) {
      const glm::dvec3 p(10 + 40 * unit(random), 20 + 20 * unit(random), 30 + 30 * unit(random));
      EXPECT_EQ(clip.keeps(glm::dvec3(kShelf.data_to_room * glm::dvec4(p, 1))), c.keeps(p))
          << c.text << " at " << p.x << " " << p.y << " " << p.z;
    }
  }
}

TEST(ClipOrder, BadOrdersAreRefused) {
  for (const char* text :
       {"plane", "plane x", "plane x>=", "plane x>=a", "plane q>=3", "plane x>3", "plane 1,2,3", "plane 0,0,0,1",
        "plane 1,2,3,4%", "plane x>=1e40", "plane x>=nan", "box 1,2,3,4,5", "box 1,2,3,1,5,6", "box 4,2,3,1,5,6",
        "sphere 1", "off; plane x>=1", "plane x>=1;", "box 0,0,0,1,1,1; box 0,0,0,1,1,1"})
    EXPECT_FALSE(parse_clip(text)) << text;
  EXPECT_FALSE(parse_clip(std::string(3000, 'x')));
}

TEST(ClipOrder, APercentageNeedsABox) {
  Placement nowhere = kShelf;
  nowhere.box_data = {};
  EXPECT_FALSE(place_clip(*parse_clip("plane x>=50%"), nowhere));
  EXPECT_TRUE(place_clip(*parse_clip("plane x>=50"), nowhere));
  EXPECT_FALSE(place_clip(*parse_clip("plane x>=1e29"), nowhere));
}

}  // namespace
}  // namespace telesplat::scene
