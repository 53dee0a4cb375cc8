// Viewers of a wall swap together; one that is late, slow, lost or dead delays the others by a frame at most.
#include <gtest/gtest.h>

#include <set>

#include "services/master/wall/swap_barrier.h"

namespace telesplat::master {
namespace {

constexpr double kPeriod_s = 1.0 / 60;

class Swaps : public ::testing::Test {
 protected:
  wire::SwapReady ready(uint64_t viewer, uint64_t frame, uint64_t viewers = 4) {
    wire::SwapReady m;
    m.viewer = {100 + viewer};
    m.wall = "lab";
    m.number = viewer;
    m.viewers = viewers;
    m.frame = frame;
    m.t_s = double(frame) + 0.1 * double(viewer);
    m.head.position_room = {double(viewer), double(frame), 0};
    m.state = {{7}, 10 * frame + viewer, 1};
    m.period_s = kPeriod_s;
    m.presented = frame == 0 ? 0 : frame - 1;
    return m;
  }
  void say(uint64_t viewer, uint64_t frame, double now_s) {
    barrier.on("peer-" + std::to_string(viewer), ready(viewer, frame), now_s);
  }
  // Returns the swaps sent since the last call, by viewer.
  std::map<std::string, wire::Swap> told() {
    std::map<std::string, wire::Swap> out;
    for (const auto& o : barrier.take_outgoing()) out[o.peer] = o.swap;
    return out;
  }
  // All four are there; frame 0 is announced at 1 s.
  void begin() {
    for (uint64_t v = 0; v < 4; ++v) say(v, 0, 1);
    ASSERT_EQ(told().size(), 4u);
  }
  SwapBarrier barrier{{42}};
};

TEST_F(Swaps, NobodyBeginsBeforeAllAreThere) {
  for (uint64_t v = 0; v < 3; ++v) say(v, 0, 1);
  EXPECT_TRUE(told().empty());
  ASSERT_TRUE(barrier.due_s());
  EXPECT_NEAR(*barrier.due_s(), 1 + SwapBarrier::kGather_s, 1e-9);
  say(3, 0, 1.5);
  const auto swaps = told();
  ASSERT_EQ(swaps.size(), 4u);
  for (const auto& [peer, swap] : swaps) {
    EXPECT_EQ(swap.frame, 0u);
    EXPECT_EQ(swap.master.value, 42u);
    EXPECT_NEAR(swap.at_s, 1.5 + SwapBarrier::kLead_s, 1e-9);
  }
}

TEST_F(Swaps, OneThatNeverComesIsNotWaitedForForEver) {
  for (uint64_t v = 0; v < 3; ++v) say(v, 0, 1);
  barrier.tick(1 + SwapBarrier::kGather_s);
  EXPECT_EQ(told().size(), 3u);
}

TEST_F(Swaps, AllGetTheHeadOfTheFirstAndWhatEverybodyHas) {
  begin();
  for (uint64_t v = 3; v < 4; --v) say(v, 1, 1.01);
  const auto swaps = told();
  ASSERT_EQ(swaps.size(), 4u);
  for (const auto& [peer, swap] : swaps) {
    EXPECT_EQ(swap.frame, 1u);
    EXPECT_EQ(swap.viewers, 4u);
    EXPECT_EQ(swap.head.position_room, glm::dvec3(0, 1, 0));
    EXPECT_EQ(swap.t_s, 1.0);
    EXPECT_EQ(swap.state.newest, 10u) << "viewer 0 has no more";
  }
}

TEST_F(Swaps, FramesAreAPeriodApart) {
  begin();
  const double first_s = 1 + SwapBarrier::kLead_s;
  for (uint64_t v = 0; v < 4; ++v) say(v, 1, 1.004);
  EXPECT_NEAR(told().begin()->second.at_s, first_s + kPeriod_s, 1e-9);
  for (uint64_t v = 0; v < 4; ++v) say(v, 2, 1.1);  // slower than that
  EXPECT_NEAR(told().begin()->second.at_s, 1.1 + SwapBarrier::kLead_s, 1e-9);
}

TEST_F(Swaps, ALateOneHoldsTheOthersForAFrameOnce) {
  begin();
  for (uint64_t v = 0; v < 3; ++v) say(v, 1, 1.005);
  EXPECT_TRUE(told().empty());
  ASSERT_TRUE(barrier.due_s());
  const double due_s = *barrier.due_s();
  EXPECT_LE(due_s, 1 + SwapBarrier::kLead_s + 2 * kPeriod_s + 1e-9) << "a frame beyond the swap that was due";
  barrier.tick(due_s - 1e-4);
  EXPECT_TRUE(told().empty());
  barrier.tick(due_s);
  auto swaps = told();
  EXPECT_EQ(swaps.size(), 4u) << "the late one hears of it, too";
  EXPECT_EQ(swaps.begin()->second.viewers, 3u);
  EXPECT_EQ(barrier.figures().incomplete, 1u);
  // From now on the others do not wait for it.
  for (uint64_t v = 0; v < 3; ++v) say(v, 2, due_s + 0.005);
  EXPECT_EQ(told().size(), 4u);
  // It comes back at the others' frame, and they wait for it after it was in time a few times.
  say(3, 1, due_s + 0.006);
  double now_s = due_s + 0.02;
  for (uint64_t frame = 3; frame < 3 + SwapBarrier::kInTime; ++frame, now_s += 0.02) {
    say(3, frame, now_s);
    for (uint64_t v = 0; v < 3; ++v) say(v, frame, now_s);
    EXPECT_EQ(told().begin()->second.viewers, 4u);
  }
  for (uint64_t v = 0; v < 3; ++v) say(v, 3 + SwapBarrier::kInTime, now_s);
  EXPECT_TRUE(told().empty()) << "it is waited for again";
}

TEST_F(Swaps, OneThatComesNowAndThenIsNotWaitedFor) {
  begin();
  for (uint64_t v = 0; v < 3; ++v) say(v, 1, 1.005);
  barrier.tick(*barrier.due_s());
  told();
  double now_s = 1.1;
  for (uint64_t frame = 2; frame < 20; ++frame, now_s += 0.02) {
    if (frame % 2 == 0) say(3, frame, now_s);
    for (uint64_t v = 0; v < 3; ++v) say(v, frame, now_s);
    ASSERT_EQ(told().size(), 4u) << frame << ": it was not in time for three frames in a row";
  }
}

// A hostile viewer reports frames that were never shown: the others' reports still count.
TEST_F(Swaps, FramesThatNobodyWasToldToPresentDoNotCount) {
  begin();
  for (uint64_t frame = 1; frame < 20; ++frame) {
    for (uint64_t v = 0; v < 4; ++v) {
      auto m = ready(v, frame);
      m.presented = v == 3 ? frame + 1000 : frame - 1;
      barrier.on("peer-" + std::to_string(v), m, 1 + 0.02 * double(frame));
    }
    EXPECT_EQ(told().begin()->second.skew_frame, frame - 1);
  }
}

TEST_F(Swaps, ADeadOneHoldsNobody) {
  begin();
  for (uint64_t v = 0; v < 3; ++v) say(v, 1, 1.005);
  EXPECT_TRUE(told().empty());
  barrier.forget({103}, 1.006);
  const auto swaps = told();
  EXPECT_EQ(swaps.size(), 3u);
  EXPECT_FALSE(swaps.contains("peer-3"));
  for (uint64_t v = 0; v < 3; ++v) say(v, 2, 1.03);
  EXPECT_EQ(told().size(), 3u);
  EXPECT_FALSE(barrier.due_s());
  for (uint64_t v = 0; v < 3; ++v) barrier.forget({100 + v}, 1.1);
  EXPECT_TRUE(barrier.empty());
}

TEST_F(Swaps, OneThatIsStartedAgainTakesItsPlace) {
  begin();
  auto again = ready(2, 0);
  again.viewer = {999};
  barrier.on("peer-new", again, 1.001);
  auto swaps = told();
  ASSERT_TRUE(swaps.contains("peer-new")) << "it goes on with the frame of the others";
  for (const uint64_t v : {0, 1, 3}) say(v, 1, 1.005);
  swaps = told();
  EXPECT_EQ(swaps.size(), 4u) << "a newcomer is not waited for";
  EXPECT_FALSE(swaps.contains("peer-2"));
}

TEST_F(Swaps, OneWhoseAnswerWasLostIsToldAgain) {
  begin();
  for (uint64_t v = 0; v < 4; ++v) say(v, 1, 1.01);
  told();
  say(2, 1, 1.3);
  const auto swaps = told();
  ASSERT_EQ(swaps.size(), 1u);
  EXPECT_EQ(swaps.begin()->first, "peer-2");
  EXPECT_EQ(swaps.begin()->second.frame, 1u);
}

TEST_F(Swaps, SkewIsFromTheFirstToTheLastThatPresented) {
  begin();
  for (uint64_t v = 0; v < 4; ++v) say(v, 1, 1.01);
  EXPECT_EQ(told().begin()->second.skew_frame, 0u) << "frame 0 shows nothing";
  for (uint64_t v = 0; v < 4; ++v) {
    auto m = ready(v, 2);
    m.presented = 1;
    m.presented_s = 1.02 + 0.001 * double(v);
    barrier.on("peer-" + std::to_string(v), m, 1.03);
  }
  const auto swaps = told();
  EXPECT_EQ(swaps.begin()->second.skew_frame, 1u);
  EXPECT_NEAR(swaps.begin()->second.skew_s, 0.003, 1e-9);
}

TEST_F(Swaps, AnotherMasterGoesOnWhereTheWallIs) {
  for (uint64_t v = 0; v < 4; ++v) say(v, 500 + v % 2, 1);
  const auto swaps = told();
  ASSERT_EQ(swaps.size(), 4u);
  EXPECT_EQ(swaps.begin()->second.frame, 501u);
}

// Larger numbers than this one are refused: a wall that began at it would stand still.
TEST_F(Swaps, OneViewersNumberLeadsNoWallToTheLastFrame) {
  say(0, uint64_t{1} << 53, 1);
  for (uint64_t v = 1; v < 4; ++v) say(v, 500, 1);
  const auto swaps = told();
  ASSERT_EQ(swaps.size(), 4u);
  EXPECT_EQ(swaps.begin()->second.frame, 500u);
}

// All use the first viewer's head; if that viewer is late, the next one's.
TEST_F(Swaps, TheHeadOfTheNextOneServesWhereTheFirstIsLate) {
  begin();
  for (uint64_t v = 1; v < 4; ++v) say(v, 1, 1.005);
  barrier.tick(*barrier.due_s());
  EXPECT_EQ(told().begin()->second.head.position_room, glm::dvec3(1, 1, 0));
}

TEST_F(Swaps, NumbersOfAModelNeverFallAndWaitOnlySoLongForOne) {
  begin();
  const auto frame = [&](uint64_t number, double now_s, uint64_t slow, uint64_t others) {
    for (uint64_t v = 0; v < 4; ++v) {
      auto m = ready(v, number);
      m.state = {{7}, v == 3 ? slow : others, 1};
      barrier.on("peer-" + std::to_string(v), m, now_s);
    }
    const auto swaps = told();
    return swaps.empty() ? ~uint64_t{0} : swaps.begin()->second.state.newest;
  };
  EXPECT_EQ(frame(1, 1.05, 20, 50), 20u);
  EXPECT_EQ(frame(2, 1.10, 15, 60), 20u) << "what was shown stays";
  EXPECT_EQ(frame(3, 1.56, 20, 70), 50u) << "the others had that half a second ago";
  EXPECT_EQ(frame(4, 1.60, 20, 90), 90u) << "it is not waited for any more";
  EXPECT_EQ(frame(5, 1.65, 90, 100), 100u);
  EXPECT_EQ(frame(6, 1.70, 100, 110), 110u);
  EXPECT_EQ(frame(7, 1.75, 110, 120), 110u) << "for three frames it had what was shown";
}

// A new packer: its numbers begin anew, and it is shown once all have received data from it.
TEST_F(Swaps, AnotherSourceIsShownWhenAllReceiveFromIt) {
  begin();
  const auto frame = [&](uint64_t number, double now_s, uint64_t of_last) {
    for (uint64_t v = 0; v < 4; ++v) {
      auto m = ready(v, number);
      m.state = v == 3 ? wire::ShownState{{of_last}, 3, 1} : wire::ShownState{{8}, 4, 1};
      barrier.on("peer-" + std::to_string(v), m, now_s);
    }
    return told().begin()->second.state;
  };
  EXPECT_EQ(frame(1, 1.05, 7).source.value, 7u);
  const auto state = frame(2, 1.1, 8);
  EXPECT_EQ(state.source.value, 8u);
  EXPECT_EQ(state.newest, 3u);
}

// A viewer that was restarted, or whose link to the packer is cut, has no picture: the others go on.
TEST_F(Swaps, AFirstViewerThatHasReceivedNothingFreezesNobody) {
  begin();
  auto again = ready(0, 0);
  again.viewer = {999};
  again.state = {};
  barrier.on("peer-new", again, 1.001);
  told();
  double now_s = 1.02;
  for (uint64_t frame = 1; frame < 200; ++frame, now_s += 0.02) {
    for (uint64_t v = 1; v < 4; ++v) say(v, frame, now_s);
    again.frame = frame;
    barrier.on("peer-new", again, now_s);
    const auto swaps = told();
    ASSERT_EQ(swaps.size(), 4u);
    ASSERT_EQ(swaps.begin()->second.state.source.value, 7u) << frame;
    ASSERT_EQ(swaps.begin()->second.state.newest, 10 * frame + 1) << frame;
  }
}

TEST_F(Swaps, WhereSourcesDifferForLongThatOfMostIsShown) {
  begin();
  const auto frame = [&](uint64_t number, double now_s) {
    for (uint64_t v = 0; v < 4; ++v) {
      auto m = ready(v, number);
      if (v > 0) m.state.source = {8};
      barrier.on("peer-" + std::to_string(v), m, now_s);
    }
    return told().begin()->second.state;
  };
  EXPECT_EQ(frame(1, 1.05).source.value, 7u);
  EXPECT_EQ(frame(2, 1.5).source.value, 7u) << "the first may yet receive from the other one";
  EXPECT_EQ(frame(3, 2.06).source.value, 8u);
  EXPECT_EQ(frame(4, 2.08).newest, 41u);
}

// Each viewer may lack other frames of slice images than its neighbours.
TEST_F(Swaps, TheNewestFrameThatAllHaveIsShown) {
  begin();
  const auto frame = [&](uint64_t number, double now_s, const std::vector<std::set<uint64_t>>& held) {
    for (uint64_t v = 0; v < 4; ++v) {
      auto m = ready(v, number);
      m.state = {{7}, *held[v].rbegin(), 0};
      for (const uint64_t f : held[v]) m.state.held |= uint64_t{1} << (m.state.newest - f);
      barrier.on("peer-" + std::to_string(v), m, now_s);
    }
    return told().begin()->second.state.newest;
  };
  EXPECT_EQ(frame(1, 1.02, {{5, 6, 7, 8}, {5, 6, 7}, {5, 6, 7}, {6, 7, 9}}), 7u);
  EXPECT_EQ(frame(2, 1.04, {{7, 8, 9}, {7, 8, 9}, {7, 10, 11}, {7, 8, 9}}), 7u) << "the third lacks 8 and 9";
  EXPECT_EQ(frame(3, 1.06, {{7, 9, 12}, {7, 9, 12}, {7, 10, 12, 13}, {7, 9, 12}}), 12u);
  EXPECT_EQ(frame(4, 1.08, {{12, 14}, {12, 14}, {12, 13, 15}, {12, 14}}), 12u);
  EXPECT_EQ(frame(5, 1.57, {{12, 16}, {12, 16}, {12, 15}, {12, 14}}), 13u)
      << "for half a second the others had newer ones";
}

TEST_F(Swaps, WhoIsNotWaitedForDoesNotHoldBackWhatTheOthersShow) {
  begin();
  for (uint64_t v = 0; v < 3; ++v) say(v, 1, 1.005);
  barrier.tick(*barrier.due_s());
  told();
  for (const uint64_t v : {3, 0, 1, 2}) {
    auto m = ready(v, 2);
    m.state = {{7}, v == 3 ? 12u : 40u, 1};
    barrier.on("peer-" + std::to_string(v), m, 1.06);
  }
  EXPECT_EQ(told().begin()->second.state.newest, 40u);
}

// If the first viewer says that views are due, all request views for the head that it sends.
TEST_F(Swaps, AllAskForViewsOfOneHead) {
  begin();
  const auto frame = [&](uint64_t number, bool asks) {
    for (uint64_t v = 0; v < 4; ++v) {
      auto m = ready(v, number);
      m.asks = v == 0 ? asks : !asks;
      m.ahead.position_room = {0, 0, double(10 * number + v)};
      barrier.on("peer-" + std::to_string(v), m, 1 + 0.02 * double(number));
    }
    const auto swaps = told();
    for (const auto& [peer, swap] : swaps) EXPECT_EQ(swap.ask, swaps.begin()->second.ask);
    return swaps.begin()->second;
  };
  EXPECT_EQ(frame(1, false).ask, 0u);
  EXPECT_EQ(frame(2, true).ask, 1u);
  const auto same = frame(3, false);
  EXPECT_EQ(same.ask, 1u);
  EXPECT_EQ(same.ask_head.position_room.z, 20);
  EXPECT_EQ(frame(4, true).ask_head.position_room.z, 40);
}

TEST_F(Swaps, AWallThatIsSlowIsNotTakenForLate) {
  begin();
  double now_s = 1.1;
  for (uint64_t frame = 1; frame < 40; ++frame, now_s += 0.1) {
    for (uint64_t v = 0; v < 3; ++v) say(v, frame, now_s);
    barrier.tick(now_s + 0.04);
    say(3, frame, now_s + 0.05);
    const auto swaps = told();
    ASSERT_FALSE(swaps.empty());
    if (frame > 30) {
      EXPECT_EQ(swaps.begin()->second.viewers, 4u) << frame;
    }
  }
}

}  // namespace
}  // namespace telesplat::master
