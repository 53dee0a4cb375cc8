#include "common/scene/placement.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <random>

namespace telesplat::scene {
namespace {

// z up becomes y up; a box of a kilometre far from the origin becomes 0.8 m.
Placement map_sheet() {
  const glm::dmat3 z_up(glm::dvec3(1, 0, 0), glm::dvec3(0, 0, -1), glm::dvec3(0, 1, 0));
  return placement_of(z_up, {{500000, 4000000, 1200}, {501000, 4000500, 1300}},
                      {{-0.4f, -0.04f, -0.2f}, {0.4f, 0.04f, 0.2f}});
}

TEST(Placement, IsUndone) {
  const Placement p = map_sheet();
  EXPECT_NEAR(p.units_per_metre(), 1250, 1e-3);
  const glm::dvec3 corner = p.to_data({0.4, 0.04, -0.2});
  EXPECT_NEAR(corner.x, 501000, 1e-3);
  EXPECT_NEAR(corner.y, 4000500, 1e-3);
  EXPECT_NEAR(corner.z, 1300, 1e-3);
  const glm::dvec3 back = p.to_room(corner);
  EXPECT_NEAR(glm::distance(back, glm::dvec3(0.4, 0.04, -0.2)), 0, 1e-9);
  const glm::dvec3 up = p.direction_to_data({0, 1, 0});
  EXPECT_NEAR(up.z, 1, 1e-12);
}

TEST(Placement, DistancesInTheRoomAreDistancesInTheData) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int i = 0; i < 200; ++i) {
    const glm::dquat turn = glm::normalize(glm::dquat(any(random), any(random), any(random), any(random)));
    Placement p{.data_to_room = glm::dmat4(glm::mat3_cast(turn) * (0.01 + std::abs(any(random)))),
                .box_data = {},
                .unit = "mm"};
    p.data_to_room[3] = glm::dvec4(any(random), any(random), any(random), 1);
    const glm::dvec3 a(any(random), any(random), any(random)), b(any(random), any(random), any(random));
    EXPECT_NEAR(glm::distance(p.to_data(a), p.to_data(b)), glm::distance(a, b) * p.units_per_metre(), 1e-9);
    const auto read = placement_from_text(to_text(p));
    ASSERT_TRUE(read) << read.error().text;
    EXPECT_EQ(*read, p);
  }
  const auto sheet = placement_from_text(to_text(map_sheet()));
  ASSERT_TRUE(sheet);
  EXPECT_EQ(*sheet, map_sheet());
}

TEST(Placement, BadTextsAreRefused) {
  for (const char* text :
       {"", "{}", "[]", "{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1]}", "{\"matrix\":[0,0,0,0,0,0,0,0,0,0,0,0]}",
        "{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,\"x\"]}", "{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,1e999]}",
        "{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0],\"lo\":[1,2,3]}", "{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0],\"unit\":3}"})
    EXPECT_FALSE(placement_from_text(text)) << text;
}

TEST(Placement, ABoxThatEndsBeforeItBeginsIsRefused) {
  const auto read =
      placement_from_text("{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0],\"lo\":[0,0,0],\"hi\":[1,-1,1],\"unit\":\"mm\"}");
  ASSERT_FALSE(read) << "it would not come back: a box that is empty is not told";
  EXPECT_NE(read.error().text.find("ends before it begins"), std::string::npos) << read.error().text;
}

}  // namespace
}  // namespace telesplat::scene
