// Camera controls, keys, title line, screenshots: a window's logic without a window.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <random>

#include "client/displays/window/input/interaction.h"
#include "client/displays/window/overlay.h"
#include "client/displays/window/screenshots.h"
#include "client/displays/window/title_line.h"
#include "client/displays/window/window_surface.h"
#include "client/viewer/coupling/view_requester.h"

namespace telesplat::viewer {
namespace {

namespace fs = std::filesystem;
using geometry::Pose;
constexpr double kPi = 3.14159265358979323846;

double angle_between(const glm::dquat& a, const glm::dquat& b) {
  return 2 * std::acos(std::min(1.0, std::abs(glm::dot(a, b))));
}
glm::dvec3 forward(const Pose& p) { return p.orientation * glm::dvec3(0, 0, -1); }
double roll(const Pose& p) { return (p.orientation * glm::dvec3(1, 0, 0)).y; }

Pose settle(CameraControls& c) {
  for (int i = 0; i < 200; ++i) c.advance(1.0 / 60);
  return c.pose();
}

void expect_same_pose(const Pose& a, const Pose& b, double tolerance = 1e-6) {
  EXPECT_LT(glm::distance(a.position_room, b.position_room), tolerance);
  EXPECT_LT(angle_between(a.orientation, b.orientation), std::max(tolerance, 1e-6));
}

TEST(CameraControls, BeginsAtHome) {
  CameraControls c;
  expect_same_pose(c.pose(), geometry::default_pose());
  expect_same_pose(settle(c), geometry::default_pose());
}

TEST(CameraControls, OrbitGoesAroundTheCentreAtTheSameDistance) {
  CameraControls c;
  const double distance = glm::length(c.pose().position_room);
  c.orbit(0.5, 0.1);
  const Pose p = settle(c);
  EXPECT_NEAR(glm::length(p.position_room), distance, 1e-6);
  EXPECT_NEAR(glm::dot(forward(p), -glm::normalize(p.position_room)), 1, 1e-9);
  EXPECT_NEAR(std::atan2(p.position_room.x, p.position_room.z), -kPi / 2, 1e-6);  // half a window: a quarter turn
  EXPECT_GT(p.position_room.y, geometry::default_pose().position_room.y);         // dragged down: seen from above
  EXPECT_NEAR(roll(p), 0, 1e-9);
}

TEST(CameraControls, OrbitStopsBeforeThePoles) {
  CameraControls c;
  for (const double dy : {3.0, -6.0}) {
    c.orbit(0, dy);
    EXPECT_NEAR(std::abs(std::asin(forward(settle(c)).y)), CameraControls::Limits::kPitch_rad, 1e-6);
  }
}

TEST(CameraControls, ThePointUnderThePointerFollowsAPan) {
  CameraControls c;
  const double distance = glm::length(c.pose().position_room), tangent = 1.25;
  const geometry::Camera before = window_camera(c.pose(), 2 * std::atan(1.0) * 180 / kPi, 1600, 1000, 0.02);
  c.pan(0.1, -0.05, tangent);
  const Pose p = settle(c);
  const geometry::Camera after = window_camera(p, 90, 1600, 1000, 0.02);
  const glm::dvec3 grabbed = before.unproject(800, 500, distance), now = after.unproject(900, 450, distance);
  EXPECT_LT(glm::distance(grabbed, now), 1e-6);
  EXPECT_LT(angle_between(p.orientation, before.pose.orientation), 1e-6);
}

TEST(CameraControls, TheWheelDolliesWithinLimits) {
  CameraControls c;
  const double distance = glm::length(c.pose().position_room), extent = 0.8;
  c.wheel(1);
  EXPECT_NEAR(glm::length(settle(c).position_room), 0.9 * distance, 1e-6);
  for (int i = 0; i < 20; ++i) c.wheel(50);
  EXPECT_NEAR(glm::length(settle(c).position_room), CameraControls::Limits::kNearest * extent, 1e-6);
  for (int i = 0; i < 20; ++i) c.wheel(-50);
  EXPECT_NEAR(glm::length(settle(c).position_room), CameraControls::Limits::kFarthest * extent, 1e-5);
}

TEST(CameraControls, MotionDoesNotDependOnTheFrameRate) {
  const auto path = [](double step_s, int steps) {
    CameraControls c;
    c.set_flying(true);
    c.fly({0.5, 0.25, 1, false});
    c.orbit(0.2, 0.1);
    for (int i = 0; i < steps; ++i) c.advance(step_s);
    return c.pose();
  };
  expect_same_pose(path(1.0 / 30, 6), path(1.0 / 240, 48), 1e-6);
  const auto orbit = [](double step_s, int steps) {
    CameraControls c;
    c.orbit(0.4, 0);
    c.wheel(3);
    for (int i = 0; i < steps; ++i) c.advance(step_s);
    return c.pose();
  };
  expect_same_pose(orbit(1.0 / 30, 3), orbit(1.0 / 120, 12), 1e-6);
}

TEST(CameraControls, MotionIsSmooth) {
  CameraControls c;
  c.orbit(0.5, 0);
  double largest = 0, total = 0;
  for (int i = 0; i < 60; ++i) {
    const Pose a = c.pose(), b = c.advance(1.0 / 60);
    largest = std::max(largest, angle_between(a.orientation, b.orientation));
    total += angle_between(a.orientation, b.orientation);
  }
  EXPECT_NEAR(total, kPi / 2, 1e-3);
  EXPECT_LT(largest, 0.3 * total);  // no jump
}

TEST(CameraControls, FlyingBeginsAndEndsWithoutMovingTheView) {
  CameraControls c;
  c.orbit(0.3, 0.1);
  c.advance(0.02);  // in the middle of a movement
  const Pose before = c.pose();
  c.set_flying(true);
  expect_same_pose(c.pose(), before, 1e-9);
  c.fly({0, 0, 1, false});
  for (int i = 0; i < 20; ++i) c.advance(0.02);
  const Pose flown = c.pose();
  EXPECT_GT(glm::distance(flown.position_room, before.position_room), 0.05);
  c.set_flying(false);
  expect_same_pose(c.pose(), flown, 1e-9);
  // From there it orbits about the place ahead.
  c.fly({});
  const Pose at = settle(c);
  c.orbit(0.2, 0);
  const Pose turned = settle(c);
  EXPECT_GT(glm::distance(at.position_room, turned.position_room), 0.05);
}

TEST(CameraControls, FlightGoesWhereItLooksAndTurnsInPlace) {
  CameraControls c;
  c.set_flying(true);
  const Pose start = c.pose();
  c.orbit(0.3, -0.2);
  const Pose looked = settle(c);
  EXPECT_LT(glm::distance(start.position_room, looked.position_room), 1e-9);
  EXPECT_GT(angle_between(start.orientation, looked.orientation), 0.3);
  double slow = 0;
  for (const bool fast : {false, true}) {
    const glm::dvec3 from = c.pose().position_room;
    c.fly({0, 0, 1, fast});
    for (int i = 0; i < 10; ++i) c.advance(0.02);
    c.fly({});
    const glm::dvec3 way = settle(c).position_room - from;
    EXPECT_NEAR(glm::dot(glm::normalize(way), forward(looked)), 1, 1e-6);
    if (!fast)
      slow = glm::length(way);
    else
      EXPECT_NEAR(glm::length(way) / slow, 4, 0.01);
  }
}

TEST(CameraControls, ResetLeadsHomeFromAnywhere) {
  CameraControls c;
  c.orbit(3.3, 0.4);
  c.set_flying(true);
  c.fly({1, 1, 1, true});
  settle(c);
  c.reset();
  EXPECT_FALSE(c.flying());
  expect_same_pose(settle(c), geometry::default_pose(), 1e-5);
}

TEST(CameraControls, TakesOverAnyPoseAndStraightensUp) {
  for (const glm::dvec3& look : {glm::dvec3(0.2, -0.5, -1), glm::dvec3(0, -1, 0), glm::dvec3(1, 1, 0.3)}) {
    Pose head = geometry::look_at(-look, glm::dvec3(0));
    head.orientation = glm::normalize(head.orientation * glm::angleAxis(0.4, glm::dvec3(0, 0, 1)));
    CameraControls c;
    c.take_over(head);
    expect_same_pose(c.pose(), head, 1e-6);
    EXPECT_NEAR(roll(settle(c)), 0, 1e-6);
  }
}

geometry::Box box_of(double half, const glm::vec3& centre = glm::vec3(0)) {
  return {centre - float(half), centre + float(half)};
}

TEST(CameraControls, TheFirstViewFollowsTheSceneUntilThePersonMoves) {
  CameraControls c;
  const Pose far = geometry::look_at({0, 4, 12}, {0, 0, 0}), aside = geometry::look_at({3, 1, 9}, {3, 0, 0});
  c.set_scene(box_of(4), far);
  expect_same_pose(c.pose(), far, 1e-9);
  c.set_scene(box_of(2, {3, 0, 0}), aside);
  expect_same_pose(settle(c), aside, 1e-9);
  c.orbit(0.1, 0);
  settle(c);
  const Pose moved = c.pose();
  EXPECT_NEAR(glm::distance(moved.position_room, glm::dvec3(3, 0, 0)),
              glm::distance(aside.position_room, glm::dvec3(3, 0, 0)), 1e-6);  // around the box's centre
  c.set_scene(box_of(1), far);                                                 // a moved camera stays
  expect_same_pose(c.pose(), moved, 1e-9);
  c.reset();
  expect_same_pose(settle(c), far, 1e-5);
}

TEST(CameraControls, AFirstViewFromFarAwayOrPastTheDataStays) {
  // A field of view of 1 degree stands far off; an eye may look away from the data.
  for (const Pose& home : {geometry::look_at({0, 20, 65}, {0, 0, 0}), geometry::look_at({10, 0, 0}, {30, 1, 0}),
                           geometry::look_at({0, -2, 0}, {0, 5, 0})}) {
    CameraControls c;
    c.set_scene(box_of(0.4), home);
    expect_same_pose(settle(c), home, 1e-5);
    c.set_flying(true);
    expect_same_pose(settle(c), home, 0.05);  // a look straight up bends by a degree
  }
}

TEST(CameraControls, NoInputLeavesTheRoom) {
  std::mt19937 random(7);
  const double wild[] = {0,
                         0.01,
                         -0.3,
                         1,
                         -7,
                         1e6,
                         -1e300,
                         std::numeric_limits<double>::infinity(),
                         std::numeric_limits<double>::quiet_NaN()};
  const auto any = [&] { return wild[random() % std::size(wild)]; };
  CameraControls c;
  for (int i = 0; i < 20000; ++i) {
    switch (random() % 8) {
      case 0:
        c.orbit(any(), any());
        break;
      case 1:
        c.pan(any(), any(), any());
        break;
      case 2:
        c.wheel(any());
        break;
      case 3:
        c.set_flying(random() % 2);
        break;
      case 4:
        c.fly({any(), any(), any(), random() % 2 == 0});
        break;
      case 5:
        c.set_scene(box_of(random() % 2 ? 0.4 : any()), geometry::default_pose());
        break;
      case 6:
        if (random() % 16 == 0) c.reset();
        break;
      default:
        break;
    }
    const Pose p = c.advance(any());
    ASSERT_TRUE(geometry::validate(window_camera(p, 90, 640, 400, 0.02)).ok())
        << i << ": " << p.position_room.x << " " << p.orientation.w << " " << p.orientation.x;
    ASSERT_LT(glm::length(p.position_room), 5e5) << i;
  }
}

// ---- keys and mouse ----

geometry::Trajectory recorded() { return geometry::Trajectory::orbit(1, 0, 4); }

class InteractionTest : public testing::Test {
 protected:
  void tap(Interaction& i, Key key) { i.key(key, true), i.key(key, false); }
  Pose wait(Interaction& i, double seconds = 1) {
    Pose p;
    for (int n = 0; n <= int(seconds * 60); ++n) p = i.advance(now_s_ += 1.0 / 60, true);
    return p;
  }
  double now_s_ = 100;
  const Look look_{{splat::Kernel::kDisc, {true, true, true}}, true};
};

TEST_F(InteractionTest, OnlyDragsMoveTheCamera) {
  Interaction i(std::nullopt, look_);
  const Pose home = wait(i);
  i.move(0.1, 0.1);
  i.move(0.6, 0.4);
  expect_same_pose(wait(i), home);
  i.button(MouseButton::kLeft, true);
  i.move(0.7, 0.4);
  i.button(MouseButton::kLeft, false);
  const Pose orbited = wait(i);
  EXPECT_NEAR(std::atan2(orbited.position_room.x, orbited.position_room.z), -0.1 * kPi, 1e-6);
  i.move(0.1, 0.1);
  expect_same_pose(wait(i), orbited);
}

TEST_F(InteractionTest, MiddleAndShiftLeftPan) {
  for (const bool middle : {true, false}) {
    Interaction i(std::nullopt, look_);
    const Pose home = wait(i);
    i.move(0.5, 0.5);
    if (!middle) i.key(Key::kShift, true);
    i.button(middle ? MouseButton::kMiddle : MouseButton::kLeft, true);
    i.move(0.6, 0.5);
    const Pose panned = wait(i);
    EXPECT_LT(angle_between(home.orientation, panned.orientation), 1e-6);
    EXPECT_LT(panned.position_room.x, home.position_room.x - 0.01);
  }
}

TEST_F(InteractionTest, KernelFinishAndShadingKeys) {
  Interaction i(std::nullopt, look_);
  const Key kernels[] = {Key::k1, Key::k2, Key::k3, Key::k4};
  for (size_t k = 0; k < 4; ++k) {
    tap(i, kernels[k]);
    EXPECT_EQ(i.look().render.kernel, splat::kKernels[k]);
  }
  EXPECT_EQ(i.take_notes().size(), 4u);
  EXPECT_TRUE(i.take_notes().empty());
  tap(i, Key::k5);
  EXPECT_FALSE(i.look().render.finish.fill);
  EXPECT_TRUE(i.look().render.finish.smooth);
  tap(i, Key::k6);
  EXPECT_FALSE(i.look().render.finish.smooth);
  tap(i, Key::k7);
  EXPECT_FALSE(i.look().render.finish.antialias);
  tap(i, Key::k8);
  EXPECT_FALSE(i.look().lit);
  tap(i, Key::k8);
  EXPECT_TRUE(i.look().lit);
  EXPECT_EQ(i.take_notes().back(), "shading on");
}

TEST_F(InteractionTest, KeysOfPointsHaveNoMeaningForVolumes) {
  Interaction i(std::nullopt, look_);
  i.set_scene(scene::Pipeline::kSlices, box_of(0.4), geometry::default_pose());
  for (int k = 0; k < 8; ++k) {
    tap(i, Key(int(Key::k1) + k));
    EXPECT_EQ(i.take_notes(), std::vector<std::string>{"key " + std::to_string(k + 1) + " has no meaning for volumes"});
  }
  EXPECT_EQ(i.look().render.kernel, look_.render.kernel);
  EXPECT_TRUE(i.look().render.finish.fill && i.look().render.finish.smooth && i.look().render.finish.antialias);
  EXPECT_TRUE(i.look().lit);
}

TEST_F(InteractionTest, KeysOfPointsChangeNothingInPictures) {
  Interaction i(std::nullopt, look_);
  i.set_scene(scene::Pipeline::kPictures, box_of(0.4), geometry::default_pose());
  tap(i, Key::k1);
  EXPECT_EQ(i.take_notes(), std::vector<std::string>{"key 1 changes nothing in pictures that servers draw"});
}

TEST_F(InteractionTest, ARecordedPathIsWhatTPlays) {
  Interaction i(std::nullopt, look_);
  wait(i, 0.1);
  tap(i, Key::kC);
  EXPECT_TRUE(i.path().records());
  i.move(0.5, 0.5);
  i.button(MouseButton::kLeft, true);
  i.move(0.7, 0.5);
  i.button(MouseButton::kLeft, false);
  wait(i, 1);
  EXPECT_NEAR(i.path().length_s(), 1, 0.05);
  const Pose end = i.advance(now_s_, true);
  tap(i, Key::kC);
  EXPECT_FALSE(i.path().records());
  const auto path = i.path().take();
  ASSERT_GE(path.size(), 60u);
  EXPECT_TRUE(i.path().take().empty());
  expect_same_pose(path.back().pose, end);
  i.set_recorded(recorded());  // the person's own recording stays
  tap(i, Key::kR);
  wait(i);
  tap(i, Key::kT);
  EXPECT_TRUE(i.playing());
  const double from_s = now_s_;
  for (int n = 1; n < 50; n += 7) {
    now_s_ = from_s + path[size_t(n)].t_s;
    expect_same_pose(i.advance(now_s_, true), path[size_t(n)].pose, 1e-6);
  }
  expect_same_pose(wait(i, 3), end);
}

TEST_F(InteractionTest, APathThatIsTooShortIsSaidAndNotKept) {
  Interaction i(std::nullopt, look_);
  tap(i, Key::kC);
  i.take_notes();
  tap(i, Key::kC);
  EXPECT_EQ(i.take_notes(), std::vector<std::string>{"the camera's path is too short to keep"});
  EXPECT_TRUE(i.path().take().empty());
  tap(i, Key::kT);
  EXPECT_FALSE(i.playing());
}

TEST_F(InteractionTest, AHeldKeyCountsOnce) {
  Interaction i(std::nullopt, look_);
  i.key(Key::kP, true);
  i.key(Key::kP, true);
  EXPECT_TRUE(i.take(Wish::kScreenshot));
  EXPECT_FALSE(i.take(Wish::kScreenshot));
}

TEST_F(InteractionTest, FlightUsesTheKeysAndEscapeEndsItFirst) {
  Interaction i(std::nullopt, look_);
  const Pose home = wait(i);
  tap(i, Key::kF);
  EXPECT_TRUE(i.wants_pointer());
  i.key(Key::kQ, true);
  const Pose sunk = wait(i, 0.2);
  EXPECT_FALSE(i.wants_to_quit());
  EXPECT_LT(sunk.position_room.y, home.position_room.y - 0.01);
  i.focus_lost();  // the key's release goes to another window
  const Pose a = wait(i), b = wait(i);
  expect_same_pose(a, b);
  tap(i, Key::kEscape);
  EXPECT_FALSE(i.wants_pointer());
  EXPECT_FALSE(i.wants_to_quit());
}

TEST_F(InteractionTest, EscapeClosesWhatIsOpenAndNeverTheProgram) {
  Interaction i(std::nullopt, look_);
  i.open().allow(true, true);
  tap(i, Key::kH);
  tap(i, Key::kO);
  EXPECT_TRUE(i.open().dialog && i.open().help);
  tap(i, Key::kEscape);
  EXPECT_FALSE(i.open().dialog);
  EXPECT_TRUE(i.open().help);
  tap(i, Key::kEscape);
  EXPECT_FALSE(i.open().help);
  i.take_notes();
  for (int n = 0; n < 5; ++n) tap(i, Key::kEscape);
  EXPECT_FALSE(i.wants_to_quit());
  EXPECT_EQ(i.take_notes().back(), "Ctrl+Q quits");
  // A dialog that is all that there is to look at stays.
  i.open().allow(true, false);
  i.show_dialog(true);
  tap(i, Key::kEscape);
  EXPECT_TRUE(i.open().dialog);
  i.control('Q');
  EXPECT_TRUE(i.wants_to_quit());
}

TEST_F(InteractionTest, NoLetterIsACommandWhileTheDialogIsOpen) {
  Interaction i(std::nullopt, look_);
  i.open().allow(true, true);
  tap(i, Key::kF);
  i.key(Key::kW, true);
  tap(i, Key::kO);  // ends the flight, which holds the pointer
  EXPECT_TRUE(i.open().dialog);
  EXPECT_FALSE(i.wants_pointer());
  const Pose before = wait(i);
  for (size_t key = 0; key < size_t(Key::kF1); ++key) tap(i, Key(key));
  tap(i, Key::kTab);
  i.key(Key::kW, true);
  expect_same_pose(wait(i), before);
  EXPECT_TRUE(i.open().dialog);
  EXPECT_FALSE(i.wants_pointer() || i.open().panel || i.wants_to_quit() || i.path().records() || i.playing());
  EXPECT_FALSE(i.take(Wish::kPick) || i.take(Wish::kNextBookmark) || i.take(Wish::kBookmark) ||
               i.take(Wish::kOverlays));
  EXPECT_FALSE(i.take(Wish::kScreenshot));
  EXPECT_TRUE(i.take_notes().empty());
  tap(i, Key::kF11);
  EXPECT_TRUE(i.take(Wish::kFullscreen));
  // A button of the panel acts all the same.
  i.press(Key::kP);
  EXPECT_TRUE(i.take(Wish::kScreenshot));
  // Where no file can be opened, the key sends the wish and opens no dialog.
  Interaction guest(std::nullopt, look_);
  tap(guest, Key::kO);
  EXPECT_FALSE(guest.open().dialog);
  EXPECT_TRUE(guest.take(Wish::kOpen));
}

TEST_F(InteractionTest, QQuitsWhenItIsPressedTwiceAndControlQAtOnce) {
  Interaction i(std::nullopt, look_);
  wait(i);
  tap(i, Key::kQ);
  EXPECT_FALSE(i.wants_to_quit());
  EXPECT_EQ(i.take_notes(), std::vector<std::string>{"press Q once more to quit"});
  wait(i, 10);
  tap(i, Key::kQ);
  EXPECT_FALSE(i.wants_to_quit()) << "that was long ago";
  wait(i, 1);
  tap(i, Key::kQ);
  EXPECT_TRUE(i.wants_to_quit());
  Interaction other(std::nullopt, look_);
  tap(other, Key::kF);
  other.control('Q');
  EXPECT_TRUE(other.wants_to_quit());
}

TEST_F(InteractionTest, HTellsEveryKey) {
  Interaction i(std::nullopt, look_);
  tap(i, Key::kH);
  EXPECT_TRUE(i.open().help);
  EXPECT_EQ(i.take_notes(), key_help());
  tap(i, Key::kH);
  EXPECT_FALSE(i.open().help);
  EXPECT_TRUE(i.take_notes().empty());
}

TEST_F(InteractionTest, F1TellsKeysAsTheyArePrintedHere) {
  Interaction i(std::nullopt, look_);
  i.set_key_names([](Key key) { return key == Key::kQ ? "A" : key == Key::kW ? "Z" : us_name(key); });
  tap(i, Key::kF1);
  EXPECT_TRUE(i.open().help);
  const auto notes = i.take_notes();
  EXPECT_NE(std::find(notes.begin(), notes.end(), "A twice              quit (not in flight)"), notes.end());
  const auto flight = std::find_if(notes.begin(), notes.end(), [](const auto& n) { return n.starts_with("F   "); });
  ASSERT_NE(flight, notes.end());
  EXPECT_NE(flight->find("fly: Z A S D, E up, A down"), std::string::npos) << *flight;
  for (const auto& line : key_help()) EXPECT_EQ(line.find_first_of("[]"), std::string::npos) << line;
}

TEST_F(InteractionTest, TabShowsThePanelAndF11AsksForAFullScreenOnce) {
  Interaction i(std::nullopt, look_);
  EXPECT_FALSE(i.open().panel);
  tap(i, Key::kTab);
  EXPECT_TRUE(i.open().panel);
  tap(i, Key::kTab);
  EXPECT_FALSE(i.open().panel);
  EXPECT_FALSE(i.take(Wish::kFullscreen));
  tap(i, Key::kF11);
  EXPECT_TRUE(i.take(Wish::kFullscreen));
  EXPECT_FALSE(i.take(Wish::kFullscreen));
}

TEST_F(InteractionTest, KeysGoOnFromALookThatWasSet) {
  Interaction i(std::nullopt, look_);
  Look look = i.look();
  look.render.finish.fill = false;
  look.background = 0xffffff;
  i.set_look(look);
  tap(i, Key::k5);
  EXPECT_TRUE(i.look().render.finish.fill);
  EXPECT_EQ(i.look().background, 0xffffffu);
}

TEST_F(InteractionTest, PlaysTheRecordedMovementUntilTheCameraIsTaken) {
  Interaction i(recorded(), look_);
  EXPECT_TRUE(i.playing());
  expect_same_pose(i.advance(10, false), recorded().at(0));
  expect_same_pose(i.advance(11, false), recorded().at(0));  // start-up: the head rests
  expect_same_pose(i.advance(12, true), recorded().at(1));
  tap(i, Key::kT);
  EXPECT_FALSE(i.playing());
  expect_same_pose(i.advance(12, true), recorded().at(1), 1e-6);  // no jump
  tap(i, Key::kT);
  expect_same_pose(i.advance(13, true), recorded().at(2));  // goes on where it was
  i.move(0.5, 0.5);
  i.button(MouseButton::kLeft, true);
  i.move(0.6, 0.5);
  EXPECT_FALSE(i.playing());
  // Without a recording, T shows a note.
  Interaction none(std::nullopt, look_);
  tap(none, Key::kT);
  EXPECT_FALSE(none.playing());
  EXPECT_EQ(none.take_notes().size(), 1u);
}

// The first view comes with its scene, in the same frame and after the session.
TEST_F(InteractionTest, AnotherDataSetIsSeenFromItsOwnFirstView) {
  Interaction i(std::nullopt, look_);
  const Pose first = geometry::look_at({0, 1, 3}, {0, 0, 0}), other = geometry::look_at({0, 4, 12}, {0, 0, 0});
  double x = 0.2;
  i.move(x, 0.2);
  const auto drag = [&] {
    i.button(MouseButton::kLeft, true);
    i.move(x += 0.1, 0.2);
    i.button(MouseButton::kLeft, false);
  };
  i.set_scene(scene::Pipeline::kPoints, box_of(0.4), first);
  wait(i);
  drag();
  wait(i);
  i.back_to_first_view();
  drag();  // the person drags at that moment
  i.set_scene(scene::Pipeline::kPoints, box_of(4), other);
  expect_same_pose(wait(i, 3), other, 1e-5);
  // Afterwards the camera is the person's again.
  drag();
  const Pose moved = wait(i, 3);
  EXPECT_GT(glm::distance(moved.position_room, other.position_room), 0.1);
  i.set_scene(scene::Pipeline::kPoints, box_of(4), first);
  expect_same_pose(wait(i), moved, 1e-5);
}

TEST_F(InteractionTest, WhoGoesElsewhereDuringAPathGoesBackToTheTracker) {
  Interaction i(std::nullopt, look_);
  const Pose told = geometry::look_at({2, 1, 3}, {0, 0, 0}), elsewhere = geometry::look_at({0, 0, 2}, {0, 0, 0});
  i.set_tracked([&](double) { return std::optional(told); });
  expect_same_pose(wait(i), told);
  i.play(recorded());
  wait(i, 0.5);
  i.go_to(elsewhere);
  expect_same_pose(wait(i), elsewhere, 1e-5);
  tap(i, Key::kT);
  expect_same_pose(wait(i), told);
}

// ---- title, camera, sampling size, screenshots ----

TEST(TitleLine, HasRatesSinceTheLastOne) {
  TitleLine line;
  FrameFigures f;
  f.now_s = 50;
  EXPECT_EQ(line.update(f), "Telesplat - waiting for the data set");
  f.session.scene = "crater.ply";
  EXPECT_EQ(line.update(f), "crater.ply - waiting for the first view");
  f.frames = 1;
  EXPECT_EQ(line.update(f), "crater.ply");
  f.now_s += 0.25;
  EXPECT_EQ(line.update(f), std::nullopt);
  f.now_s = 50.5, f.frames = 31;
  f.frame.drawn.drawn = 410'000, f.frame.drawn.cached = 1'200'000;
  f.session = {"crater.ply", 2, 212.4, 1'155'000};
  EXPECT_EQ(line.update(f),
            "crater.ply - 60.0 fps, 4.0 updates/s, 212 ms latency, 0.41 M points drawn, 1.20 M cached, 2.31 MB/s");
  f.now_s = 51, f.frames = 61, f.session = {"crater.ply", 4, 212.4, 2'310'000, 3};
  EXPECT_EQ(line.update(f),
            "crater.ply - 60.0 fps, 4.0 updates/s, 212 ms latency, 0.41 M points drawn, 1.20 M cached, 2.31 MB/s, 6.0 "
            "epochs/s");
  f.now_s = 51.5, f.frames = 91, f.session = {"crater.ply", 6, 212.4, 3'465'000, 3};
  EXPECT_EQ(line.update(f)->find("epochs"), std::string::npos) << "the scene rests";
}

TEST(WindowCamera, TheFieldOfViewSpansTheLongerSide) {
  const auto wide = window_camera({}, 90, 1600, 800, 0.02), tall = window_camera({}, 90, 400, 800, 0.02);
  EXPECT_NEAR(wide.right, 1, 1e-12);
  EXPECT_NEAR(wide.top, 0.5, 1e-12);
  EXPECT_NEAR(tall.right, 0.5, 1e-12);
  EXPECT_NEAR(tall.top, 1, 1e-12);
  EXPECT_NEAR(tall.focal_x(), tall.focal_y(), 1e-9);
}

TEST(SamplingSize, FollowsTheDisplaysAspectIfAsked) {
  RequestOptions o;
  EXPECT_EQ(sampling_size(o, 500, 1000), std::pair(1280, 800));
  o.follow_display = true;
  EXPECT_EQ(sampling_size(o, 1280, 800), std::pair(1280, 800));
  EXPECT_EQ(sampling_size(o, 2560, 1600), std::pair(1280, 800));
  const auto [w, h] = sampling_size(o, 500, 1000);
  EXPECT_NEAR(double(h) / w, 2, 0.02);
  EXPECT_NEAR(double(w) * h, 1280.0 * 800, 0.02 * 1280 * 800);
  const auto [narrow, high] = sampling_size(o, 1, geometry::kMaxImageSide);
  EXPECT_GE(narrow, 16);
  EXPECT_LE(high, geometry::kMaxImageSide);
}

TEST(ScreenshotsTest, WritesEveryPictureAndOverwritesNone) {
  const std::string directory = (fs::temp_directory_path() / "telesplat-screenshots-test").string();
  fs::remove_all(directory);
  std::vector<std::string> told;
  for (int again = 0; again < 2; ++again) {
    Screenshots s(directory, [&](const std::string& text) { told.push_back(text); });
    for (const uint32_t colour : {0x102030u, 0x405060u}) s.take({20, 10, std::vector<uint32_t>(200, colour), {}});
  }
  ASSERT_EQ(told.size(), 4u);
  for (size_t i = 0; i < told.size(); ++i) {
    ASSERT_TRUE(told[i].starts_with("screenshot: ")) << told[i];
    const auto read = image::read_view(told[i].substr(12));
    ASSERT_TRUE(read) << read.error().text;
    EXPECT_EQ(read->width, 20);
    EXPECT_EQ(read->colour[99] & 0xffffff, i % 2 ? 0x405060u : 0x102030u);
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(directory), fs::directory_iterator()), 4);
  fs::remove_all(directory);
  {
    Screenshots s("/proc/nowhere", [&](const std::string& text) { told.push_back(text); });
    s.take({1, 1, {0}, {}});
  }
  EXPECT_NE(told.back().find("/proc/nowhere"), std::string::npos) << told.back();
}

TEST(TitleLine, TellsAWait) {
  TitleLine title;
  FrameFigures f{.now_s = 1, .frames = 5, .session = {.scene = "crater"}};
  title.update(f);
  f.now_s = 4;
  f.waits_s = 3.2;
  EXPECT_EQ(title.update(f), "crater - waiting for a view update, 3 s");
  f.now_s = 5;
  f.waits_s = 0;
  f.frames = 65;
  EXPECT_TRUE(title.update(f)->starts_with("crater - 60.0 fps"));
}

TEST(TitleLine, CountsWhatIsDrawn) {
  TitleLine line;
  FrameFigures f{.now_s = 1, .frames = 1, .session = {.scene = "bonsai"}};
  line.update(f);
  f.now_s = 2;
  f.frame.drawn.drawn = 12'310'000, f.frame.drawn.cached = 2'100'000;
  f.units = {"samples", " pixels"};
  const auto text = line.update(f);
  ASSERT_TRUE(text);
  EXPECT_NE(text->find("12.31 M samples drawn, 2.10 M pixels cached"), std::string::npos) << *text;
}

TEST(Overlay, LiesInItsCornerAndShrinksToFit) {
  Overlay overlay{text_panel({"ab", "c"}, 2), Overlay::Corner::kLowerRight};
  const auto& picture = overlay.picture;
  EXPECT_GT(picture.width, 20);
  EXPECT_GT(std::count(picture.colour.begin(), picture.colour.end(), 0xfff0f0f0u), 20) << "letters";
  const auto place = place_overlay(overlay, 640, 480);
  EXPECT_EQ(place.width, picture.width);
  EXPECT_EQ(640 - place.x - place.width, 480 - place.y - place.height) << "the same margin on both sides";
  const auto small = place_overlay(overlay, 30, 300);
  EXPECT_LT(small.width, 30);
  EXPECT_GE(small.x, 0);
  overlay.corner = Overlay::Corner::kUpperLeft;
  EXPECT_EQ(place_overlay(overlay, 640, 480).x, place_overlay(overlay, 640, 480).y);
  // Beside a panel.
  EXPECT_EQ(place_overlay(overlay, 640, 480, 200).x, 200 + place_overlay(overlay, 640, 480).x);
  Overlays overlays;
  const auto before = overlays.version();
  overlays.show("help", overlay);
  EXPECT_TRUE(overlays.shows("help"));
  EXPECT_NE(overlays.version(), before);
  overlays.hide("help");
  EXPECT_TRUE(overlays.all().empty());
}

TEST(Interaction, ATrackedHeadMovesTheCameraUntilThePersonTakesIt) {
  Interaction interaction(std::nullopt, {});
  interaction.set_tracked([](double now_s) {
    return std::optional(geometry::Pose{{0.1 * now_s, 0.2, 1}, {1, 0, 0, 0}});
  });
  EXPECT_EQ(interaction.advance(3, true).position_room.x, 0.1 * 3);
  EXPECT_EQ(interaction.advance(4, false).position_room.x, 0.1 * 4);
  interaction.key(Key::kT, true);
  interaction.key(Key::kT, false);
  EXPECT_FALSE(interaction.playing());
  EXPECT_NEAR(interaction.advance(5, true).position_room.x, 0.4, 0.02) << "it stays where it was taken";
  interaction.key(Key::kT, true);
  EXPECT_EQ(interaction.advance(6, true).position_room.x, 0.1 * 6);
}

}  // namespace
}  // namespace telesplat::viewer
