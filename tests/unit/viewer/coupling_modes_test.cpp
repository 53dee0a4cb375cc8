// Credits of synchronous and loose coupling: requests that may be made, the update to display next, requests without
// answers.
#include <gtest/gtest.h>

#include <random>
#include <set>
#include <thread>

#include "client/viewer/coupling/coupling.h"
#include "client/viewer/coupling/view_requester.h"

namespace telesplat::viewer {
namespace {

using Requests = std::vector<RequestId>;

TEST(CouplingMode, HasNamesAndBuffers) {
  for (const auto mode : {CouplingMode::kAsync, CouplingMode::kSync, CouplingMode::kLoose})
    EXPECT_EQ(coupling_named(coupling_name(mode)), mode);
  EXPECT_FALSE(coupling_named("tight"));
  EXPECT_EQ(buffers_of(CouplingMode::kAsync, 3), 0);
  EXPECT_EQ(buffers_of(CouplingMode::kSync, 3), 1);
  EXPECT_EQ(buffers_of(CouplingMode::kLoose, 3), 3);
}

TEST(Coupling, AsynchronouslyEverythingMayBeAsked) {
  Coupling c(buffers_of(CouplingMode::kAsync, 3));
  EXPECT_FALSE(c.waits());
  for (uint64_t i = 1; i < 100; ++i) {
    EXPECT_TRUE(c.may_ask());
    c.asked({i}, 0);
  }
  Requests released;
  EXPECT_TRUE(c.overdue(1e6, released).empty());
  EXPECT_FALSE(c.take());
}

TEST(Coupling, SynchronouslyOneRequestAtATimeUntilItsFrameIsDisplayed) {
  Coupling c(1);
  for (uint64_t i = 1; i < 5; ++i) {
    ASSERT_TRUE(c.may_ask());
    c.asked({i}, 0);
    EXPECT_FALSE(c.may_ask());
    EXPECT_FALSE(c.take()) << "nothing to display yet";
    EXPECT_EQ(c.completed({i}, 0), Requests{{i}});
    EXPECT_FALSE(c.may_ask());
    EXPECT_EQ(c.take(), RequestId{i});
    EXPECT_FALSE(c.may_ask()) << "its frame is being displayed";
    c.displayed();
    EXPECT_FALSE(c.take()) << "an update is displayed once";
  }
}

TEST(Coupling, LooselyAsManyAsThereAreBuffers) {
  Coupling c(3);
  for (uint64_t i = 1; i <= 3; ++i) {
    ASSERT_TRUE(c.may_ask());
    c.asked({i}, 0);
  }
  EXPECT_FALSE(c.may_ask());
  c.completed({1}, 0);
  c.completed({2}, 0);
  EXPECT_EQ(c.filled(), 2);
  EXPECT_FALSE(c.may_ask()) << "complete ones fill buffers until they are displayed";
  EXPECT_EQ(c.take(), RequestId{1});
  EXPECT_FALSE(c.may_ask());
  c.displayed();
  EXPECT_TRUE(c.may_ask());
  c.asked({4}, 0);
  EXPECT_FALSE(c.may_ask());
  EXPECT_EQ(c.take(), RequestId{2});
}

TEST(Coupling, DisplaysInTheOrderOfRequests) {
  Coupling c(3);
  for (uint64_t i = 1; i <= 3; ++i) c.asked({i}, 0);
  EXPECT_TRUE(c.completed({2}, 0).empty()) << "the first is still sampled";
  EXPECT_FALSE(c.take());
  EXPECT_EQ(c.completed({1}, 0), (Requests{{1}, {2}}));
  EXPECT_EQ(c.take(), RequestId{1});
  c.displayed();
  EXPECT_EQ(c.take(), RequestId{2});
}

TEST(Coupling, WhatIsNotOpenChangesNothing) {
  Coupling c(2);
  c.asked({7}, 0);
  EXPECT_TRUE(c.completed({3}, 0).empty());
  EXPECT_EQ(c.completed({7}, 0), Requests{{7}});
  EXPECT_TRUE(c.completed({7}, 0).empty()) << "a duplicate";
  EXPECT_EQ(c.filled(), 1);
  EXPECT_FALSE(c.is_open({7}));
}

TEST(Coupling, WhereAnswersComeInOrderOvertakenRequestsFreeTheirCredits) {
  Coupling c(3);
  for (uint64_t i = 1; i <= 3; ++i) c.asked({i}, 0);
  c.skip_before({99});
  EXPECT_TRUE(c.is_open({1})) << "of a request that nobody made nothing follows";
  c.skip_before({3});
  EXPECT_FALSE(c.is_open({1}));
  EXPECT_EQ(c.completed({3}, 0), Requests{{3}});
  EXPECT_TRUE(c.may_ask());
}

TEST(Coupling, AsksAgainWhenNothingIsHeard) {
  Coupling c(2);
  Requests released;
  EXPECT_TRUE(c.overdue(100, released).empty()) << "nothing is open";
  c.asked({1}, 100);
  c.asked({2}, 101);
  EXPECT_TRUE(c.overdue(101.9, released).empty());
  c.progress(101.9);  // part of a view came
  EXPECT_TRUE(c.overdue(103.8, released).empty());
  EXPECT_EQ(c.overdue(104, released), (Requests{{1}, {2}}));
  EXPECT_TRUE(c.overdue(105, released).empty()) << "patience begins anew";
  EXPECT_EQ(c.overdue(106.1, released), (Requests{{1}, {2}}));
  EXPECT_FALSE(c.may_ask()) << "they are the same requests, with the same credits";
  EXPECT_EQ(c.completed({1}, 107), Requests{{1}});
  EXPECT_TRUE(released.empty());
}

TEST(Coupling, GivesUpWhatALaterUpdateWaitsFor) {
  Coupling c(3);
  for (uint64_t i = 1; i <= 3; ++i) c.asked({i}, 0);
  c.completed({2}, 1);
  Requests released;
  EXPECT_TRUE(c.overdue(2.9, released).empty());
  EXPECT_TRUE(released.empty());
  EXPECT_TRUE(c.overdue(3.1, released).empty());
  EXPECT_EQ(released, Requests{{2}});
  EXPECT_EQ(c.take(), RequestId{2});
  EXPECT_EQ(c.open(), Requests{{3}});
}

// With updates lost, reordered or repeated: the credits are never exceeded, updates are displayed in order and once,
// and nothing hangs.
TEST(Coupling, NeverExceedsItsBuffersAndNeverHangs) {
  for (uint32_t seed = 1; seed <= 200; ++seed) {
    std::mt19937 random(seed);
    const int buffers = 1 + int(random() % 8);
    Coupling c(buffers);
    const bool in_order = random() % 2;
    std::set<uint64_t> at_master;
    uint64_t next = 1, last_displayed = 0, frames = 0;
    double now_s = 0, last_frame_s = 0;
    const auto ask = [&](RequestId id) {
      if (random() % 10 != 0) at_master.insert(id.value);  // otherwise it is lost
    };
    for (int step = 0; step < 3000; ++step) {
      now_s += 0.02;
      while (c.may_ask()) {
        c.asked({next}, now_s);
        ask({next++});
      }
      ASSERT_LE(c.open().size() + size_t(c.filled()), size_t(buffers));
      Requests released;
      for (const RequestId id : c.overdue(now_s, released)) ask(id);
      if (random() % 200 == 0) at_master.clear();  // another master, which has no requests
      if (!at_master.empty() && random() % 3 == 0) {
        auto answered = at_master.begin();
        if (!in_order && random() % 4 == 0) answered = std::prev(at_master.end());
        const RequestId id{*answered};
        at_master.erase(answered);
        if (in_order) c.skip_before(id);
        c.completed(id, now_s);
        if (random() % 10 == 0) c.completed(id, now_s);
      }
      if (const auto shown = random() % 2 ? c.take() : std::nullopt) {
        ASSERT_GT(shown->value, last_displayed);
        last_displayed = shown->value;
        ++frames;
        last_frame_s = now_s;
        c.displayed();
      }
      // If they are lost one after the other, each request costs the patience.
      ASSERT_LT(now_s - last_frame_s, Coupling::kPatience_s * 10) << "seed " << seed;
    }
    EXPECT_GT(frames, 20u);
  }
}

TEST(CouplingGate, HandsUpdatesFromThreadToThread) {
  CouplingGate gate(2);
  EXPECT_FALSE(gate.take(0).request);
  constexpr uint64_t kUpdates = 2000;
  std::thread worker([&] {
    uint64_t next = 1;
    while (next <= kUpdates) {
      gate.with([&](Coupling& c) {
        if (!c.may_ask()) return;
        c.asked({next}, 0);
        c.completed({next}, 0);
        ++next;
      });
    }
  });
  for (uint64_t i = 1; i <= kUpdates; ++i) {
    const auto request = gate.take(60).request;
    ASSERT_TRUE(request);
    EXPECT_EQ(request->value, i);
    gate.displayed();
  }
  worker.join();
  EXPECT_FALSE(gate.take(0).request);
}

TEST(BufferedRequests, ArePacedByCreditsAndKeepTheirIdsWhenAskedAgain) {
  ViewRequester requester{{.sampling_width = 640, .sampling_height = 400, .max_rate_hz = 1, .buffers = 3}, {5}};
  geometry::Camera display = geometry::make_camera({}, 90, 1280, 800);
  requester.on_pose(0, display);
  const auto first = requester.next(0), second = requester.next(0);
  ASSERT_TRUE(first && second) << "no rate";
  EXPECT_EQ(first->buffers, 3u);
  display.pose.position_room = {1, 2, 3};
  requester.on_pose(10, display);
  requester.on_pose(11, display);
  const auto again = requester.again(std::vector{first->request, second->request, RequestId{99}}, 12);
  ASSERT_EQ(again.size(), 2u);
  EXPECT_EQ(again[0].request, first->request);
  EXPECT_EQ(again[1].request, second->request);
  EXPECT_EQ(again[0].camera.pose.position_room, glm::dvec3(1, 2, 3)) << "for the view that is wanted now";
  // Answers out of order count too.
  ViewPart part{.viewer = {5}, .request = second->request, .complete = true};
  EXPECT_TRUE(requester.on_part(part, 13));
  part.request = first->request;
  const auto update = requester.on_part(part, 14);
  ASSERT_TRUE(update);
  EXPECT_DOUBLE_EQ(update->requested_s, 0);
  EXPECT_FALSE(requester.on_part(part, 15));
}

TEST(BufferedRequests, PredictUpToTheMomentOfDisplay) {
  ViewRequester requester{{.initial_latency_s = 0.1, .buffers = 2, .prediction = tracking::Prediction::kVelocity}, {5}};
  geometry::Camera display = geometry::make_camera({}, 90, 1280, 800);
  for (int i = 0; i <= 20; ++i) {
    display.pose.position_room.x = 0.1 * i * 0.01;
    requester.on_pose(i * 0.01, display);
  }
  EXPECT_NEAR(requester.next(0.2)->camera.pose.position_room.x, 0.1 * 0.3, 1e-6) << "cameras are short";
  requester.on_displayed(0.5);
  EXPECT_NEAR(requester.next(0.2)->camera.pose.position_room.x, 0.1 * 0.7, 1e-6);
}

}  // namespace
}  // namespace telesplat::viewer
