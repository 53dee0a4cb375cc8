// Pose prediction and view requests.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "client/viewer/coupling/frame_budget.h"
#include "client/viewer/coupling/view_requester.h"
#include "common/wire/short_camera.h"

namespace telesplat::viewer {
namespace {

constexpr InstanceId kMe{5}, kOther{6};

geometry::Pose turned(double yaw_rad, const glm::dvec3& p) { return {p, glm::angleAxis(yaw_rad, glm::dvec3(0, 1, 0))}; }

class Requester : public testing::Test {
 protected:
  ViewRequester requester{{.sampling_width = 640, .sampling_height = 400, .max_rate_hz = 10}, kMe};
  geometry::Camera display = geometry::make_camera({}, 90, 1280, 800);

  wire::Patch part(RequestId request, uint64_t tile, uint64_t tiles, InstanceId viewer = kMe) {
    wire::Patch p;
    p.viewer = viewer;
    p.request = request;
    p.tile = tile;
    p.tiles_in_frame = tiles;
    p.frame_complete = tile + 1 == tiles;
    p.counts.samples = 100;
    p.counts.kept = 10;
    return p;
  }
};

TEST_F(Requester, OfAWallItAsksForTheHeadThatAllAskFor) {
  ViewRequester of_wall{
      {.sampling_width = 640, .sampling_height = 400, .max_rate_hz = 10, .wall = "lab", .wall_viewers = 4}, kMe};
  of_wall.on_pose(0.9, display);
  of_wall.on_pose(1, display);
  const auto own = of_wall.next(1);
  ASSERT_TRUE(own);
  EXPECT_EQ(own->ask, 0u);
  EXPECT_EQ(own->wall, "lab");
  EXPECT_EQ(own->wall_viewers, 4u);
  geometry::Camera asked = display;
  asked.pose.position_room = {0.5, 0, 0};
  of_wall.on_ask(1.01, 7, asked);
  const auto together = of_wall.next(1.01);
  ASSERT_TRUE(together) << "however short ago the last one was";
  EXPECT_EQ(together->ask, 7u);
  EXPECT_EQ(together->camera.pose.position_room, asked.pose.position_room);
  EXPECT_FALSE(of_wall.next(1.01 + 0.9 * ViewRequester::kAskPatience_s)) << "nothing else meanwhile";
  const auto alone = of_wall.next(1.02 + ViewRequester::kAskPatience_s);
  ASSERT_TRUE(alone) << "nobody says any more what to ask for";
  EXPECT_EQ(alone->ask, 0u);
}

TEST_F(Requester, AStillHeadGetsExactlyWhatItLooksAt) {
  EXPECT_FALSE(requester.next(0).has_value());  // no pose yet
  for (int i = 0; i < 5; ++i) requester.on_pose(i * 0.02, display);
  const auto request = requester.next(0.1);
  ASSERT_TRUE(request.has_value());
  EXPECT_EQ(request->camera.width, 640);
  EXPECT_DOUBLE_EQ(request->camera.left, display.left);
  EXPECT_DOUBLE_EQ(request->camera.top, display.top);
  EXPECT_FALSE(requester.next(0.15).has_value());  // ten a second
  EXPECT_TRUE(requester.next(0.21).has_value());
}

TEST_F(Requester, RequestsTellThePixelOfTheDisplay) {
  requester.on_pose(0, display);
  const auto r = requester.next(0);
  ASSERT_TRUE(r);
  ASSERT_EQ(r->camera.width, 640);
  EXPECT_DOUBLE_EQ(r->footprint, 2.0 / 1280);
}

TEST_F(Requester, AMovingHeadGetsAWiderViewWithinTheLimit) {
  for (int i = 0; i < 10; ++i) {
    display.pose = turned(2.0 * i * 0.02, {0, 0, 0});
    requester.on_pose(i * 0.02, display);
  }
  const auto request = requester.next(0.2);
  ASSERT_TRUE(request.has_value());
  const double ratio = (request->camera.right - request->camera.left) / (display.right - display.left);
  EXPECT_GT(ratio, 1.05);
  EXPECT_LE(ratio, 1.3 + 1e-9);
  EXPECT_TRUE(geometry::validate(request->camera).ok());
}

TEST_F(Requester, AnUpdateIsMeasuredFromRequestToItsLastPart) {
  requester.on_pose(0, display);
  const RequestId first = requester.next(0)->request, second = requester.next(1)->request;
  EXPECT_FALSE(requester.on_part(part_of(part(second, 1, 3, kOther)), 1.1).has_value());  // another viewer's part
  EXPECT_FALSE(requester.on_part(part_of(part(second, 0, 2)), 1.2).has_value());
  const auto update = requester.on_part(part_of(part(second, 1, 2)), 1.5);
  ASSERT_TRUE(update.has_value());
  EXPECT_DOUBLE_EQ(update->requested_s, 1);
  EXPECT_DOUBLE_EQ(update->first_s, 1.2);
  EXPECT_DOUBLE_EQ(update->complete_s, 1.5);
  EXPECT_EQ(update->points, 20u);
  EXPECT_EQ(update->tiles, 2u);
  EXPECT_DOUBLE_EQ(requester.latency_s(), 0.5);
  EXPECT_FALSE(
      requester.on_part(part_of(part(first, 0, 1)), 2).has_value());  // replaced at the master: will not be answered
}

TEST_F(Requester, ACoarsePassBeginsAnUpdateAndDoesNotCompleteIt) {
  requester.on_pose(0, display);
  const RequestId id = requester.next(0)->request;
  auto coarse = part(id, 0, 1);
  coarse.step = 4;
  EXPECT_TRUE(coarse.frame_complete);
  EXPECT_FALSE(requester.on_part(part_of(coarse), 0.1).has_value());
  EXPECT_DOUBLE_EQ(requester.latency_s(), 0);
  EXPECT_FALSE(requester.on_part(part_of(part(id, 0, 2)), 0.3).has_value());
  const auto update = requester.on_part(part_of(part(id, 1, 2)), 0.4);
  ASSERT_TRUE(update.has_value());
  EXPECT_DOUBLE_EQ(update->first_s, 0.1);
  EXPECT_DOUBLE_EQ(update->complete_s, 0.4);
  EXPECT_EQ(update->tiles, 3u);
  EXPECT_DOUBLE_EQ(requester.latency_s(), 0.4);
}

TEST_F(Requester, ACoarsePartThatComesLastIsNoNewUpdate) {
  requester.on_pose(0, display);
  const RequestId id = requester.next(0)->request;
  EXPECT_TRUE(requester.on_part(part_of(part(id, 0, 1)), 0.3).has_value());
  auto coarse = part(id, 0, 1);
  coarse.step = 4;
  EXPECT_FALSE(requester.on_part(part_of(coarse), 0.4).has_value());
}

TEST_F(Requester, AHeadThatTremblesAsksForTheSameViewAgain) {
  requester.on_pose(0, display);
  const geometry::Camera first = requester.next(0)->camera;
  const double quarter_rad = ViewRequester::kDeadBand_px / display.focal_x();
  // Slow, so that the head counts as resting; half of the dead band to one side, then to the other.
  double now_s = 0;
  for (const double turn : {0.5, -0.5, 0.9, 0.0}) {
    display.pose = turned(turn * quarter_rad, {0, 0, 0});
    for (int i = 0; i < 20; ++i) requester.on_pose(now_s += 0.02, display);
    EXPECT_TRUE(requester.next(now_s)->camera == first) << turn;
  }
  display.pose = turned(1.2 * quarter_rad, {0, 0, 0});
  for (int i = 0; i < 20; ++i) requester.on_pose(now_s += 0.02, display);
  const geometry::Camera next = requester.next(now_s)->camera;
  const auto apart_px = [&](const geometry::Camera& asked) {
    return screen_movement(asked.pose, display.pose, ViewRequester::kNearest_m, display.focal_x());
  };
  EXPECT_LT(apart_px(next), 5e-3) << "what is displayed, but for what is short";
  // The head drifts in small steps: the dead band is measured from the last camera requested, not from the last step.
  display.pose = turned(1.9 * quarter_rad, {0, 0, 0});
  for (int i = 0; i < 20; ++i) requester.on_pose(now_s += 0.02, display);
  EXPECT_TRUE(requester.next(now_s)->camera == next);
  display.pose = turned(2.6 * quarter_rad, {0, 0, 0});
  for (int i = 0; i < 20; ++i) requester.on_pose(now_s += 0.02, display);
  EXPECT_FALSE(requester.next(now_s)->camera == next);
  // Metres count as well as angles.
  display.pose.position_room.x += ViewRequester::kNearest_m * 1.1 * quarter_rad;
  for (int i = 0; i < 20; ++i) requester.on_pose(now_s += 0.02, display);
  EXPECT_LT(apart_px(requester.next(now_s)->camera), 5e-3);
}

// A short camera takes few bytes, and every update contains its camera.
TEST_F(Requester, AsksForCamerasThatAreShort) {
  display.pose = turned(0.123456789, {1.0 / 3, 1.0 / 7, -1.0 / 9});
  requester.on_pose(0, display);
  EXPECT_TRUE(wire::short_form(requester.next(0)->camera));
}

TEST_F(Requester, KeepsItsRateWhoeverLooksLate) {
  int count = 0;
  // 10 requests a second, polled every 0.013 s: a period that began with the last request would lose 4 % of them.
  for (int i = 0; i < 1540; ++i) {
    const double now_s = 100 + 0.013 * i;
    requester.on_pose(now_s, display);
    count += requester.next(now_s).has_value();
    if (const auto due_s = requester.due_in_s(now_s)) EXPECT_LE(*due_s, 0.1);
  }
  EXPECT_GE(count, 200);
  EXPECT_LE(count, 202);
  // A pause saves up no requests: at most one goes out at once.
  requester.on_pose(200, display);
  EXPECT_TRUE(requester.next(200).has_value());
  EXPECT_FALSE(requester.next(200.05).has_value());
}

class SteeredRequester : public Requester {
 protected:
  SteeredRequester() { requester.set_steered(true); }
  // Returns the number of requests within `for_s` of a head that moves at speed_m_s; each is answered after 50 ms.
  int requests(double for_s, uint64_t kept, double speed_m_s = 0, uint64_t left_out = 0) {
    int count = 0;
    for (const double end_s = now_s + for_s; now_s < end_s; now_s += 0.01) {
      display.pose.position_room.x += speed_m_s * 0.01;
      requester.on_pose(now_s, display);
      if (const auto request = requester.next(now_s)) {
        ++count;
        open = request->request, answer_s = now_s + 0.05;
      }
      if (open.value == 0 || now_s < answer_s) continue;
      auto p = part(open, 0, 1);
      p.left_out = left_out;
      p.counts.kept = kept, p.counts.samples = kept + 300;  // the others were cast to see whether they agree
      EXPECT_TRUE(requester.on_part(part_of(p), now_s).has_value());
      open = {};
    }
    return count;
  }
  double now_s = 100, answer_s = 0;
  RequestId open;
};

TEST_F(SteeredRequester, AViewThatLacksNothingIsAskedForOnceASecond) {
  EXPECT_GE(requests(2, 10), 17) << "it brings points: ten a second, and two for the first one's epoch";
  const int quiet = requests(5, 0);
  EXPECT_GE(quiet, 5);
  EXPECT_LE(quiet, 7);
  EXPECT_GE(requests(2, 0, 0.5), 18) << "the head moves";
  EXPECT_LE(requests(3, 0), 6);
  EXPECT_GE(requests(2, 5), 12) << "something has changed: within a second it is asked for at the full rate again";
}

TEST_F(SteeredRequester, AViewThatWasOvertakenBeforeAnythingCameLacksSomething) {
  EXPECT_GE(requests(2, 10), 17);
  EXPECT_GE(requests(3, 0, 0, 5), 27);
}

TEST_F(SteeredRequester, TheNextViewIsAskedForWhenTheLastOneIsComplete) {
  // Each is answered after 0.25 s, when two more are due.
  std::vector<double> asked_s, answered_s;
  for (const double end_s = now_s + 3; now_s < end_s; now_s += 0.01) {
    display.pose.position_room.x += 0.005;
    requester.on_pose(now_s, display);
    if (open.value != 0 && now_s >= answer_s) {
      EXPECT_TRUE(requester.on_part(part_of(part(open, 0, 1)), now_s).has_value());
      answered_s.push_back(now_s);
      open = {};
    }
    const auto request = requester.next(now_s);
    if (!request) continue;
    EXPECT_EQ(open.value, 0u) << "one at a time";
    open = request->request, answer_s = now_s + 0.25;
    asked_s.push_back(now_s);
  }
  ASSERT_GT(asked_s.size(), 9u);
  for (size_t i = 1; i < asked_s.size(); ++i) EXPECT_EQ(asked_s[i], answered_s[i - 1]);
  // A lost request does not stop the requester for good.
  int count = 0;
  for (const double end_s = now_s + 2; now_s < end_s; now_s += 0.01) {
    display.pose.position_room.x += 0.005;
    requester.on_pose(now_s, display);
    count += requester.next(now_s).has_value();
  }
  EXPECT_GE(count, 3);
}

TEST_F(SteeredRequester, ANewEpochIsAskedForAtOnce) {
  requests(3, 0);
  requests(0.3, 0);
  requester.on_epoch(now_s);
  EXPECT_GE(requests(0.5, 0), 4);
}

TEST_F(SteeredRequester, AViewOnItsWayIsNotAskedForAgainUntilItSeemsLost) {
  requests(2, 0);
  display.pose.position_room.x += 0.1;
  int count = 0;
  for (const double end_s = now_s + 3.5; now_s < end_s; now_s += 0.01) {
    requester.on_pose(now_s, display);
    count += requester.next(now_s).has_value();
  }
  EXPECT_GE(count, 4) << "nobody answers: once a second";
  EXPECT_LE(count, 8) << "while the step was still seen as a movement the view was another one";
}

TEST_F(SteeredRequester, WithoutSteeringARestingHeadAsksAtTheFullRate) {
  requester.set_steered(false);
  EXPECT_GE(requests(2, 0), 18);
}

TEST_F(Requester, ExtraPatchesCompleteNothingAndCountApart) {
  requester.on_pose(0, display);
  const RequestId first = requester.next(0)->request;
  auto extra = part(first, 0, 1);
  extra.extra = true, extra.counts.kept = 7;
  const std::array<std::byte, 5> bytes{};
  extra.image = bytes;
  ASSERT_TRUE(extra.frame_complete);
  EXPECT_FALSE(requester.on_part(part_of(extra), 0.1).has_value());
  const auto update = requester.on_part(part_of(part(first, 0, 1)), 0.2);
  ASSERT_TRUE(update.has_value());
  EXPECT_EQ(update->points, 10u);
  EXPECT_EQ(update->tiles, 1u);
  EXPECT_DOUBLE_EQ(update->first_s, 0.2);
  EXPECT_EQ(update->extra.points, 7u);
  EXPECT_EQ(update->extra.bytes, 5u);
  EXPECT_FALSE(requester.on_part(part_of(extra), 0.3).has_value()) << "of an update that is over";
  const RequestId second = requester.next(1)->request;
  EXPECT_EQ(requester.on_part(part_of(part(second, 0, 1)), 1.1)->extra.points, 7u);
}

class AdaptiveRequester : public testing::Test {
 protected:
  ViewRequester requester{{.max_rate_hz = 1000, .adaptive = true, .target_latency_s = 0.2}, kMe};
  geometry::Camera display = geometry::make_camera({}, 90, 2560, 1600);
  double now_s = 0;

  // Asks for a view and answers it after pixels / pixels_per_s. whole: each pixel has a sample. Returns the camera.
  geometry::Camera cycle(double pixels_per_s, bool moving, bool whole = false) {
    for (int i = 0; i < 12; ++i, now_s += 0.02) {
      if (moving) display.pose = turned(0.4 * now_s, {0, 0, 0});
      requester.on_pose(now_s, display);
    }
    const auto request = requester.next(now_s);
    EXPECT_TRUE(request.has_value());
    now_s += double(request->camera.width) * request->camera.height / pixels_per_s;
    wire::Patch last;
    last.viewer = kMe;
    last.request = request->request;
    last.frame_complete = true;
    last.counts.samples = whole ? uint64_t(request->camera.width) * uint64_t(request->camera.height) : 0;
    EXPECT_TRUE(requester.on_part(part_of(last), now_s).has_value());
    return request->camera;
  }
  double density(const geometry::Camera& c) const { return c.focal_x() / display.focal_x(); }
};

TEST_F(AdaptiveRequester, AStillHeadSeesEveryPixelsOwnSample) {
  EXPECT_EQ(cycle(1e7, false).width, 1280) << "the first view is wanted soon";
  const geometry::Camera c = cycle(1e6, false);
  EXPECT_EQ(c.width, 2560);
  EXPECT_EQ(c.height, 1600);
  EXPECT_DOUBLE_EQ(c.left, display.left);
}

TEST_F(AdaptiveRequester, AStillHeadOfAChangingSceneIsServedAsFastAsAMovingOne) {
  cycle(1e7, false);
  for (int i = 0; i < 30; ++i) {
    requester.on_epoch(now_s);
    const geometry::Camera c = cycle(1e7, false);
    EXPECT_LE(double(c.width) * c.height, 2.2e6) << "0.2 s, ten million pixels a second";
    EXPECT_DOUBLE_EQ(c.left, display.left);
    if (i > 20) {
      EXPECT_NEAR(double(c.width) * c.height, 2e6, 2e5);
    }
  }
  const double last_s = now_s;
  geometry::Camera c = cycle(1e7, false);
  while (now_s < last_s + 1) c = cycle(1e7, false);
  c = cycle(1e7, false);
  EXPECT_EQ(c.width, 2560) << "the scene rests, and so does the head";
}

TEST_F(AdaptiveRequester, AChangingSceneMayBeSampledMoreCoarsely) {
  geometry::Camera c;
  for (int i = 0; i < 40; ++i) {
    requester.on_epoch(now_s);
    c = cycle(1e5, true);
  }
  EXPECT_NEAR(density(c), 0.25, 0.01);
  now_s += 2;
  cycle(1e5, true);
  EXPECT_NEAR(density(cycle(1e5, true)), 0.5, 0.01) << "it rests: half a sample a pixel at least, as ever";
}

TEST_F(AdaptiveRequester, SamplesAsFinelyAsTheLatencyAllows) {
  geometry::Camera c = cycle(1e7, true);
  EXPECT_NEAR(density(c), 0.5, 0.01);  // 1280x800 at first
  for (int i = 0; i < 30; ++i) c = cycle(1e7, true);
  // 2 million pixels in 0.2 s, in a view wider than the display's.
  EXPECT_NEAR(double(c.width) * c.height, 2e6, 2e5);
  EXPECT_GT(c.right, display.right);
  EXPECT_GT(density(c), 0.6);
  EXPECT_LT(density(c), 0.72);

  for (int i = 0; i < 30; ++i) c = cycle(1e9, true);
  EXPECT_NEAR(density(c), 1.0, 0.01);  // no finer than the display
  for (int i = 0; i < 30; ++i) c = cycle(1e5, true);
  EXPECT_NEAR(density(c), 0.5, 0.01);  // no coarser than half of the display
}

TEST_F(AdaptiveRequester, SteeredSamplingGoesByOctavesAndOnlyWhereUpdatesAgree) {
  requester.set_steered(true);
  cycle(1e8, true);
  cycle(1e8, true);
  EXPECT_NEAR(density(cycle(1e8, true)), 0.707, 0.01) << "two fast updates";
  for (int i = 0; i < 3; ++i) cycle(1e8, true);
  EXPECT_NEAR(density(cycle(1e8, true)), 1, 0.01);
  cycle(1e6, true);
  cycle(1e6, true);
  EXPECT_NEAR(density(cycle(1e8, true)), 1, 0.01) << "two slow ones are chance";
  for (int i = 0; i < 3; ++i) cycle(1e6, true);
  EXPECT_NEAR(density(cycle(1e8, true)), 0.707, 0.01);
  for (int i = 0; i < 20; ++i) cycle(1e6, true);
  EXPECT_NEAR(density(cycle(1e8, true)), 0.5, 0.01) << "no coarser than half of the display";
}

TEST_F(AdaptiveRequester, OneSteeredViewThatWasSampledWholeAndTookFarTooLongIsEnough) {
  requester.set_steered(true);
  for (int i = 0; i < 6; ++i) cycle(1e8, true);
  EXPECT_NEAR(density(cycle(1e7, true)), 1, 0.01);
  EXPECT_NEAR(density(cycle(3e7, true, true)), 1, 0.01) << "few rays took long: chance";
  EXPECT_NEAR(density(cycle(1e7, true, true)), 1, 0.01) << "0.14 s, where 0.1 s are wished";
  EXPECT_NEAR(density(cycle(1e7, true, true)), 0.5, 0.01) << "0.41 s";
}

// Unseen surfaces that come into sight take longer than the views of known ones took.
TEST_F(AdaptiveRequester, ASteeredViewOfATurningHeadIsWideHoweverFastTheLastOnesCame) {
  for (const bool steered : {false, true}) {
    requester.set_steered(steered);
    geometry::Camera c;
    for (int i = 0; i < 30; ++i) c = cycle(1e9, true);
    const double margin = c.right / display.right - 1;  // at 0.4 radians a second
    if (steered)
      EXPECT_NEAR(margin, 0.02 + 0.6 * 0.4 * 0.2, 0.005) << "as far as it turns in the time wished for an update";
    else
      EXPECT_LT(margin, 0.03);
  }
}

}  // namespace
}  // namespace telesplat::viewer
