// A person's changes of a scene: transfer functions, steps, parameters, timelines, and the orders that they give.
#include "client/displays/window/panel/scene_controls.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace telesplat::viewer {
namespace {

volume::Session session_of_volume() {
  volume::Session s;
  s.grid.size = {16, 16, 16};
  s.range = {.lo = 0, .hi = 255, .typical_lo = 20, .typical_hi = 200};
  s.steps = 5;
  s.transfer = *volume::parse_transfer("0:#000000:0,100:#ff0000:0.5,255:#ffffff:1", s.range);
  return s;
}

wire::Welcome welcome_of(const volume::Session& s) {
  wire::Welcome w;
  w.facts = volume::to_facts(s);
  w.facts["kind"] = "volume";
  w.facts[volume::kHistogramFact] = "0:256:5,0,7,9";
  w.parameters = volume::to_parameters(s);
  return w;
}

class VolumeControlsTest : public testing::Test {
 protected:
  VolumeControlsTest() { controls_.on_session(0, welcome_of(session_)); }
  volume::Session session_ = session_of_volume();
  std::vector<Order> orders_;
  SceneControls controls_{[this](Order o) { orders_.push_back(std::move(o)); }};
};

TEST_F(VolumeControlsTest, ShowWhatTheSessionHas) {
  EXPECT_EQ(controls_.kind(), scene::Kind::kVolume);
  ASSERT_TRUE(controls_.volume());
  EXPECT_EQ(controls_.transfer().transfer(), session_.transfer);
  ASSERT_TRUE(controls_.transfer().histogram());
  EXPECT_EQ(controls_.transfer().histogram()->counts, (std::vector<uint64_t>{5, 0, 7, 9}));
  EXPECT_EQ(controls_.transfer().lo(), 0);
  EXPECT_EQ(controls_.transfer().hi(), 255);
  auto w = welcome_of(session_);
  w.facts[volume::kHistogramFact] = "nonsense";
  controls_.on_session(1, w);
  EXPECT_FALSE(controls_.transfer().histogram());
  EXPECT_TRUE(controls_.volume()) << "only the histogram is missing";
}

TEST_F(VolumeControlsTest, ADraggedPointStaysBetweenItsNeighboursAndIsOrdered) {
  controls_.edit([](TransferEditor& e) { return e.move(1, 1, 300, 1.5); });
  const auto& p = controls_.transfer().transfer().points[1];
  EXPECT_EQ(p.value, 255);
  EXPECT_EQ(p.opacity, 1);
  ASSERT_EQ(orders_.size(), 1u);
  EXPECT_EQ(orders_[0].command, "tf");
  EXPECT_EQ(orders_[0].subject, "transfer");
  const auto parsed = volume::parse_transfer(orders_[0].arguments.at("transfer"), session_.range);
  ASSERT_TRUE(parsed) << parsed.error().text;
  EXPECT_EQ(*parsed, controls_.transfer().transfer());
  controls_.edit([](TransferEditor& e) { return e.move(1, 1, 300, 1.5); });
  EXPECT_EQ(orders_.size(), 1u) << "nothing changed";
  controls_.edit([](TransferEditor& e) { return e.move(1, 17, 3, 0.5); });
  EXPECT_EQ(orders_.size(), 1u) << "there is no such point";
}

TEST_F(VolumeControlsTest, PointsAreAddedOnTheCurveAndTakenAway) {
  controls_.edit([](TransferEditor& e) { return e.add(1, 50); });
  const auto& points = controls_.transfer().transfer().points;
  ASSERT_EQ(points.size(), 4u);
  EXPECT_EQ(points[1].value, 50);
  EXPECT_NEAR(double(points[1].opacity), 0.25, 1e-6);
  EXPECT_NEAR(double(points[1].r), 0.5, 1e-6);
  for (int i = 0; i < 5; ++i) controls_.edit([](TransferEditor& e) { return e.remove(1, 1); });
  EXPECT_EQ(controls_.transfer().transfer().points.size(), 2u) << "the last two stay";
}

TEST_F(VolumeControlsTest, AFunctionHasNoMorePointsThanItsTextHolds) {
  for (int i = 0; i < 2000; ++i)
    controls_.edit([&](TransferEditor& e) { return e.add(1, 100.123456789 + i * 0.070123456); });
  EXPECT_GT(controls_.transfer().transfer().points.size(), 20u);
  EXPECT_LE(controls_.transfer().text().size(), volume::kMaxTransferText);
}

TEST_F(VolumeControlsTest, WhatIsWantedIsShownUntilTheSessionHasIt) {
  controls_.edit([](TransferEditor& e) { return e.move(10, 1, 120, 0.7); });
  const auto wanted = controls_.transfer().transfer();
  controls_.on_session(10.5, welcome_of(session_));  // an older session
  EXPECT_EQ(controls_.transfer().transfer(), wanted);
  controls_.on_session(20, welcome_of(session_));
  EXPECT_EQ(controls_.transfer().transfer(), session_.transfer) << "somebody else had it another way";
  controls_.edit([](TransferEditor& e) { return e.move(30, 1, 120, 0.7); });
  controls_.on_answer({orders_.back(), false, "no"});
  EXPECT_EQ(controls_.transfer().transfer(), session_.transfer);
}

TEST_F(VolumeControlsTest, APresetIsOrderedByItsName) {
  controls_.choose_preset("fire");
  EXPECT_EQ(orders_.back().arguments.at("transfer"), "fire");
}

TEST_F(VolumeControlsTest, ASavedFunctionIsReadAgain) {
  const std::string path = (std::filesystem::temp_directory_path() / "telesplat-transfer-test.json").string();
  ASSERT_TRUE(controls_.save_transfer(path));
  std::ifstream in(path);
  std::stringstream content;
  content << in.rdbuf();
  std::remove(path.c_str());
  const auto read = volume::parse_paraview_json(content.str(), path, session_.range);
  ASSERT_TRUE(read) << read.error().text;
  EXPECT_EQ(*read, session_.transfer);
  EXPECT_FALSE(controls_.save_transfer("/nonexistent/folder/tf.json"));
}

TEST_F(VolumeControlsTest, StepsAndSpeedAreOrderedWithinTheirLimits) {
  controls_.choose_step(1, 99);
  EXPECT_EQ(orders_.back().arguments.at("volume.step"), "4");
  EXPECT_EQ(controls_.value("volume.step"), 4) << "shown at once";
  controls_.choose_speed(1, 2.5);
  EXPECT_EQ(orders_.back().arguments.at("volume.steps-per-s"), "2.5");
  controls_.play_series(false);
  EXPECT_EQ(orders_.back().command, "animate");
  EXPECT_EQ(orders_.back().arguments.at("timeline"), "off");
}

class JuliaControlsTest : public testing::Test {
 protected:
  JuliaControlsTest() {
    welcome_.facts["kind"] = "julia";
    welcome_.parameters = julia::to_map(julia::presets()[0].parameters);
    controls_.on_session(0, welcome_);
  }
  static const julia::ParameterInfo& info(std::string_view name) {
    for (const auto& i : julia::parameter_infos())
      if (i.name == name) return i;
    ADD_FAILURE() << name;
    return julia::parameter_infos()[0];
  }
  wire::Welcome welcome_;
  std::vector<Order> orders_;
  SceneControls controls_{[this](Order o) { orders_.push_back(std::move(o)); }};
};

TEST_F(JuliaControlsTest, AParameterIsOrderedWithinItsLimitsAndShownAtOnce) {
  controls_.set(1, info("c.y"), 77);
  EXPECT_EQ(controls_.value("c.y"), info("c.y").most);
  ASSERT_EQ(orders_.size(), 1u);
  EXPECT_EQ(orders_[0].command, "set");
  EXPECT_EQ(orders_[0].subject, "c.y");
  controls_.set(1, info("c.y"), 77);
  EXPECT_EQ(orders_.size(), 1u);
  controls_.set(1, info("iterations"), 20.4);
  EXPECT_EQ(orders_.back().arguments.at("iterations"), "20");
  const double before = welcome_.parameters.at("c.y");
  controls_.on_answer({orders_[0], false, "the slice is empty"});
  EXPECT_EQ(controls_.value("c.y"), before);
}

TEST_F(JuliaControlsTest, KeyFramesMakeATimelineThatTheMasterReads) {
  EXPECT_TRUE(controls_.timeline().empty());
  controls_.play();
  EXPECT_TRUE(orders_.empty());
  controls_.add_key(info("c.y"), 5, 0.4);
  ASSERT_EQ(controls_.timeline().tracks.size(), 1u);
  EXPECT_EQ(controls_.timeline().tracks[0].keys.size(), 3u) << "from the value now, and back to it";
  EXPECT_EQ(controls_.timeline_s(), 10);
  controls_.add_key(info("c.y"), 5.01, 0.3);
  EXPECT_EQ(controls_.timeline().tracks[0].keys[1].value, 0.3) << "in place of the one there";
  controls_.add_key(info("c.y"), 7.5, 0.1);
  controls_.add_key(info("c.x"), 0, 0.2);
  controls_.add_key(info("iterations"), 3, 20);
  EXPECT_EQ(controls_.timeline().tracks.size(), 2u) << "what is whole is not animated";
  controls_.play();
  ASSERT_EQ(orders_.size(), 1u);
  const auto parsed = julia::parse_timeline(orders_[0].arguments.at("timeline"));
  ASSERT_TRUE(parsed) << parsed.error().text;
  EXPECT_EQ(parsed->tracks.size(), 2u);
  EXPECT_NEAR(parsed->values(5).at("c.y"), 0.3, 1e-12);
  for (const auto& track : parsed->tracks)
    EXPECT_EQ(track.keys.front().value, track.keys.back().value) << track.name << ": a repeat does not jump";
  controls_.stop();
  EXPECT_EQ(orders_.back().arguments.at("timeline"), "off");
}

TEST_F(JuliaControlsTest, ATrackThatLosesItsKeyFramesGoes) {
  controls_.add_key(info("c.y"), 5, 0.4);
  controls_.remove_key(0, 0);
  ASSERT_EQ(controls_.timeline().tracks.size(), 1u);
  EXPECT_EQ(controls_.timeline().tracks[0].keys.front().t_s, 0) << "it begins at 0 all the same";
  controls_.remove_key(0, 0);
  EXPECT_TRUE(controls_.timeline().empty());
  controls_.remove_key(3, 1);
}

}  // namespace
}  // namespace telesplat::viewer
