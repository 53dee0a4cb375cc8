// The panel without its window: plots, choices and their effects.
#include "client/displays/window/panel/panel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace telesplat::viewer {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(History, KeepsTheSpanAndForgetsWhatIsOlder) {
  History h(10);
  EXPECT_TRUE(h.empty());
  for (int i = 0; i <= 20; ++i) h.add(i, i);
  EXPECT_EQ(h.newest(), 20);
  const auto columns = h.columns(20, 10);
  ASSERT_EQ(columns.size(), 10u);
  for (size_t i = 0; i < 9; ++i) EXPECT_FLOAT_EQ(columns[i], float(10 + i)) << i;
  EXPECT_FLOAT_EQ(columns[9], 20) << "the newest value belongs to the last column";
}

TEST(History, AColumnShowsItsPeakAndAnEmptyOneWhatWasBefore) {
  History h(10);
  h.add(1, 5), h.add(1.2, 90), h.add(1.4, 5), h.add(7, 3);
  const auto columns = h.columns(10, 10);
  EXPECT_TRUE(std::isnan(columns[0])) << "nothing was before";
  EXPECT_FLOAT_EQ(columns[1], 90);
  EXPECT_FLOAT_EQ(columns[2], 90);
  EXPECT_FLOAT_EQ(columns[7], 3);
  EXPECT_FLOAT_EQ(columns[9], 3);
}

TEST(History, WhatIsNoNumberIsIgnoredAndATimeThatGoesBackBeginsAnew) {
  History h(10);
  h.add(1, 5), h.add(2, kNan), h.add(kNan, 7), h.add(3, std::numeric_limits<double>::infinity());
  EXPECT_EQ(h.newest(), 5);
  h.add(0.5, 9);
  EXPECT_TRUE(std::isnan(h.columns(1, 20)[0]));
  EXPECT_EQ(h.newest(), 9);
}

TEST(History, IsBounded) {
  History h(1e9);
  for (size_t i = 0; i < 3 * History::kMost; ++i) h.add(double(i), 1);
  const auto columns = h.columns(3.0 * History::kMost, 2);
  EXPECT_EQ(columns.size(), 2u);
  EXPECT_FLOAT_EQ(columns[1], 1);
}

class PanelTest : public testing::Test {
 protected:
  static Panel::Setup setup() { return {.viewer = "viewer-1"}; }
  Panel panel_{setup()};
};

TEST_F(PanelTest, RatesAreMeansOfHalfASecond) {
  FrameFigures f{.now_s = 100,
                 .frames = 10,
                 .frame = {.previous_s = 1, .end_s = 1.016, .drawn = {.drawn = 500'000}},
                 .session = {.updates = 1, .latency_ms = 80}};
  panel_.on_figures(f);
  EXPECT_EQ(panel_.plots().frames_a_second(), 0);
  for (int i = 1; i <= 60; ++i) {
    f.now_s = 100 + i / 60.0;
    ++f.frames;
    f.session.bytes_received += 50'000;
    panel_.on_figures(f);
  }
  EXPECT_NEAR(panel_.plots().frames_a_second(), 60, 1e-6);
  EXPECT_NEAR(panel_.plots().plots()[3].history.newest(), 3.0, 1e-6) << "MB/s";
  EXPECT_NEAR(panel_.plots().plots()[0].history.newest(), 16, 1e-9);
  EXPECT_NEAR(panel_.plots().plots()[1].history.newest(), 80, 1e-9);
  EXPECT_NEAR(panel_.plots().plots()[2].history.newest(), 0.5, 1e-9);
}

TEST_F(PanelTest, WhatIsChosenOfTheWindowIsTakenOnceAndShownAtOnce) {
  EXPECT_EQ(panel_.value("splat"), "");
  panel_.on_values({{"splat", "disc"}, {"legend", "on"}});
  panel_.choose("splat", "ewa");
  EXPECT_EQ(panel_.value("splat"), "ewa");
  EXPECT_EQ(panel_.value("legend"), "on");
  EXPECT_EQ(panel_.take_chosen(), (std::vector<std::pair<std::string, std::string>>{{"splat", "ewa"}}));
  EXPECT_TRUE(panel_.take_chosen().empty());
  panel_.on_values({{"splat", "disc"}});
  EXPECT_EQ(panel_.value("splat"), "disc") << "the window did not take it";
}

TEST_F(PanelTest, ACouplingIsOrderedForThisViewerAndPendingUntilItIsInForce) {
  panel_.choose_coupling(coupling_state(CouplingMode::kLoose, 4));
  const auto orders = panel_.take_orders();
  ASSERT_EQ(orders.size(), 1u);
  EXPECT_EQ(orders[0].command, "coupling");
  const std::map<std::string, std::string> wanted{{"coupling", "loose"}, {"buffers", "4"}, {"viewer", "viewer-1"}};
  EXPECT_EQ(orders[0].arguments, wanted);
  EXPECT_TRUE(panel_.coupling_pending());
  EXPECT_EQ(panel_.coupling(), coupling_state(CouplingMode::kLoose, 4));
  panel_.choose_coupling(coupling_state(CouplingMode::kLoose, 4));
  EXPECT_TRUE(panel_.take_orders().empty()) << "it is ordered already";
  panel_.on_figures({.now_s = 1, .frame = {.coupling = coupling_state(CouplingMode::kLoose, 4)}});
  EXPECT_FALSE(panel_.coupling_pending());
  panel_.choose_coupling(coupling_state(CouplingMode::kSync, 0));
  EXPECT_FALSE(panel_.take_orders()[0].arguments.contains("buffers"));
}

TEST_F(PanelTest, WhatIsRefusedIsToldAndNotPendingAnyMore) {
  panel_.choose_coupling(coupling_state(CouplingMode::kSync, 0));
  const Order order = panel_.take_orders()[0];
  panel_.on_answer(5, {order, false, "no viewer is here"});
  EXPECT_FALSE(panel_.coupling_pending());
  EXPECT_EQ(panel_.coupling().mode, CouplingMode::kAsync);
  ASSERT_EQ(panel_.messages().size(), 1u);
  EXPECT_TRUE(panel_.messages()[0].problem);
  EXPECT_EQ(panel_.messages()[0].text, "coupling: no viewer is here");
  panel_.on_answer(6, {order, true, "viewer-1: sync"});
  EXPECT_EQ(panel_.messages().size(), 1u) << "what is seen need not be told";
  panel_.on_answer(6, {{"epoch", {}, {}}, true, "epoch 2"});
  EXPECT_EQ(panel_.messages().back().text, "epoch: epoch 2");
}

TEST_F(PanelTest, NewsAreWhatIsMissingElseAYoungMessage) {
  EXPECT_TRUE(panel_.news(0).empty());
  panel_.tell(10, "screenshot: a.png");
  EXPECT_EQ(panel_.news(11), std::vector<std::string>{"screenshot: a.png"});
  EXPECT_TRUE(panel_.news(10 + 2 * Panel::kTold_s).empty());
  panel_.on_status(30, std::nullopt, "no master is at X");
  EXPECT_EQ(panel_.news(100), std::vector<std::string>{"no master is at X"});
  panel_.on_status(31, std::nullopt, "no master is at X");
  EXPECT_EQ(panel_.messages().size(), 2u) << "it is told once";
  SessionStatus all;
  for (const char* role : {"data", "packer", "sampler"}) all.processes.push_back({.role = role, .name = role});
  panel_.on_status(32, all, "");
  EXPECT_TRUE(panel_.news(100).empty());
}

TEST_F(PanelTest, AServiceThatIsMissingForAMomentIsNotTold) {
  panel_.on_status(10, SessionStatus{}, "");
  EXPECT_TRUE(panel_.news(10).empty());
  panel_.on_status(10 + Panel::kGrace_s / 2, SessionStatus{}, "");
  EXPECT_TRUE(panel_.messages().empty());
  panel_.on_status(10.1 + Panel::kGrace_s, SessionStatus{}, "");
  EXPECT_EQ(panel_.news(14).size(), 3u);
  EXPECT_EQ(panel_.messages().size(), 3u);
  panel_.on_progress("reading a.ply 43 %");
  EXPECT_EQ(panel_.news(14), std::vector<std::string>{"reading a.ply 43 %"});
}

TEST_F(PanelTest, MessagesAreBounded) {
  for (size_t i = 0; i < 3 * Panel::kMostMessages; ++i) panel_.tell(double(i), std::to_string(i));
  EXPECT_EQ(panel_.messages().size(), Panel::kMostMessages);
  EXPECT_EQ(panel_.messages().back().text, std::to_string(3 * Panel::kMostMessages - 1));
}

TEST(SessionStatus, TellsWhoIsHereAndWhoIsMissing) {
  const auto status = read_status(R"({"animation": "c.y=0:1:5s", "processes": [
    {"role": "data", "name": "data", "alive": true, "silent_s": 0.2},
    {"role": "sampler", "name": "sampler-1", "alive": true, "silent_s": 7.4},
    {"role": "packer", "name": "packer", "alive": false, "silent_s": 0.1}, 17, {"role": 3}]})");
  ASSERT_TRUE(status) << status.error().text;
  EXPECT_EQ(status->animation, "c.y=0:1:5s");
  ASSERT_EQ(status->processes.size(), 4u);
  const auto missing = missing_services(*status);
  ASSERT_EQ(missing.size(), 2u);
  EXPECT_EQ(missing[0], "sampler-1 has said nothing for 7 s");
  EXPECT_NE(missing[1].find("waiting for a packer"), std::string::npos) << missing[1];
  for (const char* bad : {"", "[]", "17", "{", "\"status\""}) EXPECT_FALSE(read_status(bad)) << bad;
  EXPECT_TRUE(read_status("{}"));
  EXPECT_EQ(read_status(R"({"animation": "off"})")->animation, "");
  EXPECT_EQ(missing_services({}).size(), 3u);
}

}  // namespace
}  // namespace telesplat::viewer
