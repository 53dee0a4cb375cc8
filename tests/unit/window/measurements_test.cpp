// A person's measurements in a window: rows of places, their texts, their marks in the picture.
#include "client/viewer/hands/measurements.h"
#include "client/displays/window/hands/hand_overlays.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace telesplat::viewer {
namespace {

class Measuring : public testing::Test {
 protected:
  Measuring() {
    terms.placement =
        scene::placement_of(glm::dmat3(1), {{0, 0, 0}, {800, 800, 800}}, {{-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}});
    terms.placement.unit = "mm";
  }
  uint64_t add(const glm::dvec3& room) {
    Pick pick;
    pick.position_room = room, pick.origin_room = room + glm::dvec3(0, 0, 1);
    return *all.add(pick, terms, EpochId{2}, 0.25);
  }
  nlohmann::json list() const { return nlohmann::json::parse(all.list()); }

  SceneTerms terms;
  Measurements all;
};

TEST_F(Measuring, APlaceIsAnEstimateUntilTheDataServerAnswers) {
  add({0, 0, 0});
  auto probes = all.take_probes();
  ASSERT_EQ(probes.size(), 1u);
  EXPECT_TRUE(scene::probe_from(probes[0]));
  EXPECT_TRUE(all.take_probes().empty()) << "asked once";
  EXPECT_TRUE(list()["places"][0].contains("pending"));
  EXPECT_FALSE(list()["places"][0].contains("error"));
  EXPECT_EQ(all.on_answer({{"epoch", "9"}}, true, "{}"), "") << "another one's answer";
  const std::string line =
      all.on_answer(probes[0], true, R"({"room":[0.01,0,0],"error_m":0.001,"value":7,"value_error":1})");
  EXPECT_NE(line.find("1: 410.000, 400.000, 400.000 mm +- 1 mm; 7.0 +- 1"), std::string::npos) << line;
  const auto place = list()["places"][0];
  EXPECT_NEAR(place["data"][0].get<double>(), 410, 1e-4);
  EXPECT_NEAR(place["error"].get<double>(), 1, 1e-6);
  EXPECT_FALSE(place.contains("estimate"));
  EXPECT_FALSE(place.contains("pending"));
}

TEST_F(Measuring, AnyBoundIsTold) {
  for (const char* error : {"1e-320", "0", "1e300"}) {
    add({0, 0, 0});
    const std::string answer = fmt::format(R"({{"room":[0,0,0],"error_m":{0},"value":7,"value_error":{0}}})", error);
    EXPECT_NE(all.on_answer(all.take_probes()[0], true, answer).find("+-"), std::string::npos) << error;
  }
}

TEST_F(Measuring, WithoutADataServerItIsToldToBeAnEstimate) {
  add({0, 0, 0});
  const std::string line = all.on_answer(all.take_probes()[0], false, "probe: no data server is here");
  EXPECT_NE(line.find("an estimate: probe: no data server is here"), std::string::npos) << line;
  EXPECT_EQ(line.find("+-"), std::string::npos) << "no bound is printed";
  EXPECT_EQ(list()["places"][0]["estimate"], "probe: no data server is here");
}

TEST_F(Measuring, RowsHaveDistancesAndAngles) {
  add({0.3, 0, 0}), add({0, 0, 0}), add({0, 0.1, 0});
  all.begin_row();
  add({0, 0, 0.1});
  ASSERT_EQ(all.rows().size(), 2u);
  const auto places = list()["places"];
  EXPECT_NEAR(places[1]["distance"].get<double>(), 300, 1e-3);
  EXPECT_NEAR(places[2]["angle_deg"].get<double>(), 90, 1e-6);
  EXPECT_EQ(all.between(all.rows()[0], 2), "100 mm from 2, 90.00 degrees at 2");
  EXPECT_FALSE(places[3].contains("distance")) << "it begins a row";

  ASSERT_TRUE(all.remove(2));
  EXPECT_NEAR(list()["places"][1]["distance"].get<double>(), 100 * std::sqrt(10.0), 1e-3);
  EXPECT_FALSE(all.remove(2)) << "numbers are given once";
  EXPECT_EQ(add({0, 0, 0}), 5u);
  all.clear();
  EXPECT_TRUE(all.empty());
}

TEST_F(Measuring, ATableHasALineAPlace) {
  terms.placement.unit = "mm, as \"measured\"";
  add({0.3, 0, 0}), add({0, 0, 0});
  const std::string table = all.csv();
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 3);
  EXPECT_NE(table.find("\n1,1,699.99"), std::string::npos) << table;
  EXPECT_NE(table.find("\"mm, as \"\"measured\"\"\""), std::string::npos) << table;
}

TEST_F(Measuring, ThereAreNotTooMany) {
  for (size_t i = 0; i < Measurements::kMost; ++i) add({0, 0, 0});
  Pick pick;
  EXPECT_FALSE(all.add(pick, terms, EpochId{2}, 0.25));
}

// True if the picture of the marks has a colour there.
bool marked(const MarksPicture& marks, double x, double y) {
  const int column = int(x) - marks.x, row = int(y) - marks.y;
  if (column < 0 || row < 0 || column >= marks.view.width || row >= marks.view.height) return false;
  return marks.view.colour[size_t(row) * size_t(marks.view.width) + size_t(column)] >> 24 != 0;
}

TEST_F(Measuring, MarksLieOverTheirPlaces) {
  const auto camera = geometry::make_camera({{0, 0, 1}, {1, 0, 0, 0}}, 60, 640, 480, 0.01);
  EXPECT_EQ(draw_marks(all, camera, 1).view.width, 0);
  add({0, 0, 0}), add({0.2, 0.1, 0});
  const auto marks = draw_marks(all, camera, 1);
  const auto [x, y, w] = camera.room_to_pixel();
  for (const glm::dvec3 room : {glm::dvec3(0), glm::dvec3(0.2, 0.1, 0), glm::dvec3(0.05, 0.025, 0)}) {
    const glm::dvec4 h(room, 1);
    EXPECT_TRUE(marked(marks, glm::dot(x, h) / glm::dot(w, h), glm::dot(y, h) / glm::dot(w, h))) << room.x;
  }
  EXPECT_FALSE(marked(marks, 320, 400));
  // Both arms of a cross; the line between two places of one height.
  for (const glm::dvec2 arm : {glm::dvec2(4, 0), glm::dvec2(-4, 0), glm::dvec2(0, 4)})
    EXPECT_TRUE(marked(marks, 320 + arm.x, 240 + arm.y)) << arm.x << " " << arm.y;
  all.clear();
  add({-0.2, 0, 0}), add({0.2, 0, 0});
  EXPECT_TRUE(marked(draw_marks(all, camera, 1), 320 - 70, 240));
  all.clear();
  add({0, 0, 0}), add({0.2, 0.1, 0});
  EXPECT_LT(marks.view.width * marks.view.height, 640 * 480 / 4) << "only the part that has marks";
  // A place behind the eye gets no mark, and lines end at the window's edge.
  auto away = camera;
  away.pose.orientation = {0, 0, 1, 0};
  EXPECT_EQ(draw_marks(all, away, 1).view.width, 0);
  add({30, 0, 0});
  const auto far = draw_marks(all, camera, 1);
  EXPECT_LE(far.x + far.view.width, 640);
  EXPECT_TRUE(marked(far, 639, 240 - 5) || far.x + far.view.width == 640);
}

}  // namespace
}  // namespace telesplat::viewer
