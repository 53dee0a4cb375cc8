#include "common/scene/placement.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <random>

namespace telesplat::scene {
namespace {

// z up becomes y up; a box of a kilometre far from the origin becomes 0.8 m wide.
Placement map_sheet() {
  const glm::dmat3 z_up(glm::dvec3(1, 0, 0), glm::dvec3(0, 0, -1), glm::dvec3(0, 1, 0));
  return placement_of(z_up, {{500000, 4000000, 1200}, {501000, 4000500, 1300}},
                      {{-0.4f, -0.04f, -0.2f}, {0.4f, 0.04f, 0.2f}});
}

TEST(Placement, IsUndone) {
  const Placement p = map_sheet();
  EXPECT_NEAR(p.length_of({0, 0, 1}), 1250, 1e-3);
  const glm::dvec3 corner = p.to_data({0.4, 0.04, -0.2});
  EXPECT_NEAR(corner.x, 501000, 1e-3);
  EXPECT_NEAR(corner.y, 4000500, 1e-3);
  EXPECT_NEAR(corner.z, 1300, 1e-3);
  const glm::dvec3 back = glm::dvec3(p.data_to_room * glm::dvec4(corner, 1));
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
    EXPECT_NEAR(glm::distance(p.to_data(a), p.to_data(b)), p.length_of(a - b), 1e-9);
    const auto read = placement_from_text(to_text(p));
    ASSERT_TRUE(read) << read.error().text;
    EXPECT_EQ(*read, p);
  }
  const auto sheet = placement_from_text(to_text(map_sheet()));
  ASSERT_TRUE(sheet);
  EXPECT_EQ(*sheet, map_sheet());
}

// A terrain in degrees, shown in metres with heights times three.
Placement degrees() {
  Coordinates c{Space::kGeographic, "EPSG:4326 WGS 84", "degrees", "m", {80000, 110574, 3}, {80000, 110574, 1}};
  const glm::dmat3 z_up(glm::dvec3(1, 0, 0), glm::dvec3(0, 0, -1), glm::dvec3(0, 1, 0));
  const geometry::DBox shown{{7 * 80000.0, 46 * 110574.0, 3 * 400.0}, {8 * 80000.0, 47 * 110574.0, 3 * 4400.0}};
  Placement p = placement_of(z_up, shown, {{-0.289f, -0.0217f, -0.4f}, {0.289f, 0.0217f, 0.4f}}, c);
  p.unit = "m";
  return p;
}

TEST(Placement, CoordinatesAreTheFilesOwnWhateverIsShown) {
  const Placement p = degrees();
  EXPECT_NEAR(p.box_data.lo.x, 7, 1e-12);
  EXPECT_NEAR(p.box_data.hi.y, 47, 1e-12);
  EXPECT_NEAR(p.box_data.hi.z, 4400, 1e-9);
  const glm::dvec3 peak(7.65861, 45.97639 + 0.5, 4478);
  const glm::dvec3 back = p.to_data(glm::dvec3(p.data_to_room * glm::dvec4(peak, 1)));
  EXPECT_NEAR(back.x, peak.x, 1e-9);
  EXPECT_NEAR(back.z, peak.z, 1e-6);
  EXPECT_EQ(place_text(p, peak), "lon 7.6586100, lat 46.4763900, height 4478.000 m (EPSG:4326 WGS 84)");
  // By the series of the ellipsoid at 46.5 degrees: 111412.84 cos L - 93.5 cos 3L, 111132.95 - 559.85 cos 2L + 1.175
  // cos 4L.
  EXPECT_NEAR(p.way({7, 46.5, 0}, {8, 46.5, 0}).x, 76762.6, 1);
  EXPECT_NEAR(p.way({7, 46, 0}, {7, 47, 0}).y, 111161.1, 1);
  EXPECT_NEAR(p.way({7, 46, 100}, {7, 46, 350}).z, 250, 1e-9) << "true heights";
  EXPECT_NEAR(p.way({179.9, 0, 0}, {-179.9, 0, 0}).x, 0.2 * 111319.49, 1) << "across the date line";
  const auto read = placement_from_text(to_text(p));
  ASSERT_TRUE(read) << read.error().text;
  EXPECT_EQ(*read, p);
}

TEST(Placement, PatientsAxesAreNamed) {
  Placement p{.box_data = {{-100, -100, 0}, {100, 100, 300}}, .unit = "mm"};
  p.coordinates.space = Space::kLps;
  EXPECT_EQ(place_text(p, {-12.3, -45.6, 78.9}), "R 12.300  A 45.600  S 78.900 mm (LPS -12.300, -45.600, 78.900)");
  EXPECT_EQ(place_text(p, {12.3, 45.6, -1}), "L 12.300  P 45.600  I 1.000 mm (LPS 12.300, 45.600, -1.000)");
  p.coordinates.space = Space::kRas;
  EXPECT_EQ(place_text(p, {12.3, 45.6, 78.9}), "R 12.300  A 45.600  S 78.900 mm (RAS 12.300, 45.600, 78.900)");
}

TEST(Placement, MapsKeepMillimetres) {
  Placement p{.box_data = {{400000, 5200000, 0}, {510000, 5310000, 3000}}, .unit = "m"};
  p.coordinates = {Space::kProjected, "EPSG:32632 WGS 84 / UTM zone 32N", "m", "m"};
  EXPECT_EQ(place_text(p, {432123.4567, 5212345.6789, 1234.5674}),
            "x 432123.457, y 5212345.679 m, height 1234.567 m (EPSG:32632 WGS 84 / UTM zone 32N)");
}

TEST(Placement, BadTextsAreRefused) {
  for (const char* text :
       {"", "{}", "[]", "{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1]}", "{\"matrix\":[0,0,0,0,0,0,0,0,0,0,0,0]}",
        "{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,\"x\"]}", "{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,1e999]}",
        "{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0],\"lo\":[1,2,3]}",
        "{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0],\"coordinates\":{\"space\":\"moon\",\"shown\":[1,1,1],\"lengths\":[1,1,"
        "1]}}",
        "{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0],\"coordinates\":{\"space\":\"LPS\",\"shown\":[1,0,1],\"lengths\":[1,1,1]"
        "}}",
        "{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0],\"unit\":3}"})
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
