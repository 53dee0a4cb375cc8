// The question to a data server, its answer, and the texts that people read of both.
#include "common/scene/probe.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "common/scene/told_place.h"

namespace telesplat::scene {
namespace {

TEST(Probe, ComesBack) {
  const Probe asked{EpochId{7}, {0.1, -2.5e-7, 3}, glm::normalize(glm::dvec3(1, 2, -3)), 0.4};
  const auto read = probe_from(to_arguments(asked));
  ASSERT_TRUE(read) << read.error().text;
  EXPECT_EQ(read->epoch, asked.epoch);
  EXPECT_EQ(read->origin_room, asked.origin_room);
  EXPECT_NEAR(glm::distance(read->direction_room, asked.direction_room), 0, 1e-15);
  EXPECT_EQ(read->opacity, 0.4);
}

TEST(Probe, WhatIsNoRayIsRefused) {
  const auto good = to_arguments({});
  ASSERT_TRUE(probe_from(good));
  for (const auto& [key, bad] : std::initializer_list<std::pair<const char*, const char*>>{{"epoch", "-1"},
                                                                                           {"epoch", "1.5"},
                                                                                           {"origin", "1,2"},
                                                                                           {"origin", "1,2,nan"},
                                                                                           {"origin", "1,2,3,4"},
                                                                                           {"direction", "0,0,0"},
                                                                                           {"direction", "0,0,2"},
                                                                                           {"opacity", "0"},
                                                                                           {"opacity", "1.1"},
                                                                                           {"opacity", ""}}) {
    auto arguments = good;
    arguments[key] = bad;
    const auto read = probe_from(arguments);
    ASSERT_FALSE(read) << key << " " << bad;
    EXPECT_NE(read.error().text.find(key), std::string::npos) << read.error().text;
  }
  EXPECT_FALSE(probe_from({}));
}

TEST(Probed, ComesBack) {
  Probed found{{1, 2, 3}, {0, 1, 0}, 0.25, "heat", "K", 21.5, 0.03};
  EXPECT_EQ(*probed_from_text(to_text(found)), found);
  found = {{1, 2, 3}, {}, {}, "", "", {}, {}};
  EXPECT_EQ(*probed_from_text(to_text(found)), found);
  for (const char* bad : {"", "[]", "{}", "{\"room\":[1,2]}", "{\"room\":[1,2,3],\"value\":\"x\"}"})
    EXPECT_FALSE(probed_from_text(bad)) << bad;
}

Placement millimetres() {
  Placement p = placement_of(glm::dmat3(1), {{0, 0, 0}, {800, 800, 800}}, {{-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}});
  p.unit = "mm";
  return p;
}

TEST(ToldPlaces, AnEstimateBecomesAMeasurement) {
  const Placement p = millimetres();
  ToldPlace place{.room = {0.1, 0, 0}, .data = p.to_data({0.1, 0, 0})};
  place.estimate = "from what the viewer shows";
  place.array = "heat", place.value = 20;
  EXPECT_EQ(value_text(place), "heat about 20") << "an estimate has no bound";
  refine(place, {{0.2, 0, 0}, {0, 1, 0}, 0.002, "heat", "K", 21.5, 0.03}, p);
  EXPECT_NEAR(place.data.x, 600, 1e-4);
  EXPECT_NEAR(*place.error, 2, 1e-4);
  EXPECT_TRUE(place.estimate.empty());
  EXPECT_EQ(value_text(place), "heat 21.500 +- 0.03 K");
  ToldPlace rough = place;
  rough.value = 291.4, rough.value_error = 229.95;
  EXPECT_EQ(value_text(rough), "heat 291 +- 230 K");
  rough.value_error = 1e-310;
  EXPECT_EQ(value_text(rough), "heat 291.400000000000 +- 1e-310 K");
  const auto again = told_place_from(to_json(place, p), p);
  ASSERT_TRUE(again);
  EXPECT_EQ(*again, place);
}

TEST(ToldPlaces, LengthsAndAnglesAreInTheDatasUnits) {
  const Placement p = millimetres();
  const auto at = [&](const glm::dvec3& room) { return ToldPlace{.room = room, .data = p.to_data(room)}; };
  const ToldPlace places[] = {at({0.3, 0, 0}), at({0, 0, 0}), at({0, 0.1, 0.1}), at({0, 0.1, 0.1})};
  const Measured m = measure(places, p);
  ASSERT_EQ(m.distances.size(), 3u);
  EXPECT_NEAR(m.distances[0], 300, 1e-3);
  EXPECT_NEAR(m.distances[1], 100 * std::sqrt(2.0), 1e-3);
  ASSERT_EQ(m.angles_deg.size(), 2u);
  EXPECT_NEAR(m.angles_deg[0], 90, 1e-6);
  EXPECT_TRUE(std::isnan(m.angles_deg[1])) << "no angle at a place that is picked twice";
  EXPECT_TRUE(measure({}, p).distances.empty());
  EXPECT_EQ(length_text(12.3456, "mm"), "12.3456 mm");
  EXPECT_EQ(length_text(0.5, ""), "0.5");
}

}  // namespace
}  // namespace telesplat::scene
