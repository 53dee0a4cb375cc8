// Other moves of the camera than orbit and flight: sides of the data, tilt, centre, and the part that a panel covers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "client/displays/window/input/interaction.h"
#include "client/displays/window/window_surface.h"
#include "common/geometry/fit.h"

namespace telesplat::viewer {
namespace {

using geometry::Pose;
constexpr double kPi = 3.14159265358979323846;

Pose settle(CameraControls& c) {
  for (int i = 0; i < 200; ++i) c.advance(1.0 / 60);
  return c.pose();
}

double turn_between(const Pose& a, const Pose& b) {
  return 2 * std::acos(std::min(1.0, std::abs(glm::dot(a.orientation, b.orientation))));
}
double apart(const Pose& a, const Pose& b) {
  return std::max(glm::distance(a.position_room, b.position_room), turn_between(a, b));
}

// Direction in which a place of the room is seen, as tangents from the view's axis, +y up.
glm::dvec2 seen_at(const Pose& pose, const glm::dvec3& place) {
  const glm::dvec3 p = glm::conjugate(pose.orientation) * (place - pose.position_room);
  EXPECT_LT(p.z, 0) << "it lies behind the eye";
  return glm::dvec2(p) / -p.z;
}

geometry::Box box_of(const glm::vec3& half, const glm::vec3& centre = glm::vec3(0)) {
  return {centre - half, centre + half};
}

const geometry::Camera kWindow = window_camera({}, 60, 1280, 800, 0.02);

// ---- fitted views ----

// The part of the window that no panel covers, and the place of its middle.
struct FreePart {
  geometry::Camera frustum = kWindow;
  double middle_x = 0;
};
FreePart free_part(double left, double right) {
  FreePart out;
  const double half = kWindow.right;
  out.middle_x = (left - right) * half;
  out.frustum.left *= 1 - left - right, out.frustum.right *= 1 - left - right;
  return out;
}

void expect_inside(const Pose& pose, const geometry::Box& box, const FreePart& part, const char* what) {
  const auto& f = part.frustum;
  double nearest = 1e9;  // distance from a side, over the half width or height
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 p(corner & 1 ? box.hi.x : box.lo.x, corner & 2 ? box.hi.y : box.lo.y,
                       corner & 4 ? box.hi.z : box.lo.z);
    const glm::dvec2 at = seen_at(pose, p) - glm::dvec2(part.middle_x, 0);
    nearest = std::min({nearest, 1 - std::abs(at.x) / f.right, 1 - std::abs(at.y) / f.top});
  }
  EXPECT_GE(nearest, geometry::kFitMargin - 1e-6) << what;
  EXPECT_LE(nearest, 0.3) << what << ": it could be nearer";
}

TEST(FittedViews, ShowTheWholeBoxInThePartThatIsFree) {
  for (const auto& box : {box_of({0.4f, 0.1f, 0.4f}), box_of({0.1f, 0.4f, 0.1f}), box_of({0.4f, 0.4f, 0.4f}),
                          box_of({0.4f, 0.02f, 0.1f}, {1, -2, 3})})
    for (const auto& [left, right] : {std::pair{0.0, 0.0}, {0.28, 0.0}, {0.28, 0.1}, {0.0, 0.2}, {0.5, 0.0}}) {
      const FreePart part = free_part(left, right);
      expect_inside(geometry::fitted_view(box, part.frustum, part.middle_x), box, part, "first view");
      for (int side = 0; side < 6; ++side) {
        glm::dvec3 back(0.0);
        back[side / 2] = side % 2 ? -1 : 1;
        const Pose pose = geometry::fitted_view_from(back, box, part.frustum, part.middle_x);
        EXPECT_LT(glm::distance(pose.orientation * glm::dvec3(0, 0, 1), back), 1e-9) << side;
        expect_inside(pose, box, part, "side");
        const glm::dvec3 up = pose.orientation * glm::dvec3(0, 1, 0);
        EXPECT_GT(side / 2 == 1 ? std::abs(up.z) : up.y, 0.999) << side;
      }
    }
}

// ---- the camera ----

TEST(CameraControls, OrbitsAboutTheMiddleOfThePartThatIsFree) {
  const auto box = box_of({0.4f, 0.2f, 0.3f});
  const FreePart part = free_part(0.28, 0);
  const Pose home = geometry::fitted_view(box, part.frustum, part.middle_x);
  CameraControls c;
  c.set_scene(box, home, part.middle_x);
  EXPECT_LT(apart(c.pose(), home), 1e-6);
  const glm::dvec3 pivot = c.view().anchor;
  EXPECT_LT(std::hypot(pivot.x, pivot.z), 1e-6) << "the data set's vertical axis";
  for (const auto& [dx, dy] : {std::pair{0.3, 0.1}, {-0.8, -0.2}, {0.1, 0.5}}) {
    c.orbit(dx, dy);
    const glm::dvec2 at = seen_at(settle(c), pivot);
    EXPECT_NEAR(at.x, part.middle_x, 1e-6);
    EXPECT_NEAR(at.y, 0, 1e-6);
  }
  // The panel goes: a moved camera stays, and home is another pose.
  const Pose moved = c.pose(), whole = geometry::fitted_view(box, kWindow);
  c.set_scene(box, whole, 0);
  EXPECT_LT(apart(settle(c), moved), 1e-6);
  c.reset();
  EXPECT_LT(apart(settle(c), whole), 1e-5);
  // Back at home, the camera follows the panel again, without a jump.
  c.set_scene(box, home, part.middle_x);
  EXPECT_LT(apart(c.pose(), whole), 1e-5);
  EXPECT_LT(apart(settle(c), home), 1e-5);
}

TEST(CameraControls, FlightBeginsAndEndsWithoutMovingTheViewBesideAPanel) {
  const auto box = box_of({0.4f, 0.2f, 0.3f});
  const FreePart part = free_part(0.28, 0);
  CameraControls c;
  c.set_scene(box, geometry::fitted_view(box, part.frustum, part.middle_x), part.middle_x);
  c.orbit(0.3, 0.1);
  const Pose before = settle(c);
  c.set_flying(true);
  EXPECT_LT(apart(settle(c), before), 1e-6);
  c.set_flying(false);
  EXPECT_LT(apart(settle(c), before), 1e-6);
}

TEST(CameraControls, ALiftedHandZoomsAsTheWheelDoes) {
  CameraControls wheel, drag;
  wheel.wheel(3);
  drag.dolly(-0.1);
  EXPECT_LT(apart(settle(wheel), settle(drag)), 1e-6);
  drag.dolly(0.1);
  EXPECT_LT(apart(settle(drag), geometry::default_pose()), 1e-6);
}

TEST(CameraControls, ATiltedHeadStaysTiltedAndDragsFollowThePointer) {
  CameraControls c;
  c.roll(0.5);  // a quarter turn
  const Pose tilted = settle(c);
  EXPECT_NEAR(turn_between(tilted, geometry::default_pose()), kPi / 2, 1e-6);
  // With a tilted head, too, a drag to the right moves the near side of the data to the right.
  const glm::dvec3 near_side = glm::normalize(tilted.position_room) * 0.4;
  const double before = seen_at(tilted, near_side).x;
  c.orbit(0.1, 0);
  const glm::dvec2 after = seen_at(settle(c), near_side);
  EXPECT_GT(after.x, before + 0.05);
  EXPECT_NEAR(after.y, seen_at(tilted, near_side).y, 0.05);
  c.reset();
  EXPECT_LT(apart(settle(c), geometry::default_pose()), 1e-5);
}

TEST(CameraControls, APlaceComesToTheMiddleAndIsWhatItTurnsAbout) {
  const auto box = box_of({0.4f, 0.2f, 0.3f});
  for (const double left : {0.0, 0.28}) {
    const FreePart part = free_part(left, 0);
    CameraControls c;
    c.set_scene(box, geometry::fitted_view(box, part.frustum, part.middle_x), part.middle_x);
    const Pose before = c.pose();
    const glm::dvec3 place(0.25, 0.1, 0.2);
    c.centre_on(place);
    const Pose centred = settle(c);
    EXPECT_NEAR(std::abs(glm::dot(before.orientation, centred.orientation)), 1, 1e-9) << "it looks the same way";
    const glm::dvec3 ahead = before.orientation * glm::dvec3(0, 0, -1);
    EXPECT_NEAR(glm::dot(place - before.position_room, ahead), glm::dot(place - centred.position_room, ahead), 1e-6);
    c.orbit(0.4, 0.2);
    const glm::dvec2 at = seen_at(settle(c), place);
    EXPECT_NEAR(at.x, part.middle_x, 1e-6);
    EXPECT_NEAR(at.y, 0, 1e-6);
  }
}

TEST(CameraControls, TravelsToStraightAboveAndToWhereItWas) {
  CameraControls c;
  const auto box = box_of({0.4f, 0.4f, 0.4f});
  c.set_scene(box, geometry::fitted_view(box, kWindow));
  c.roll(0.2);
  c.orbit(2.3, 0.2);
  settle(c);
  const CameraControls::View was = c.view();
  const Pose before = c.pose();
  for (const double y : {1.0, -1.0}) {
    const Pose above = geometry::fitted_view_from({0, y, 0}, box, kWindow);
    c.travel(above);
    EXPECT_LT(apart(c.pose(), before), 1e-6) << "it jumped";
    EXPECT_LT(apart(settle(c), above), 1e-5);
    c.travel(was);
    EXPECT_LT(apart(settle(c), before), 1e-5);
  }
}

TEST(CameraControls, NoPlaceNorTiltLeavesTheRoom) {
  std::mt19937 random(3);
  const double wild[] = {0, 0.3, -1, 1e6, -1e300, HUGE_VAL, NAN};
  const auto any = [&] { return wild[random() % std::size(wild)]; };
  CameraControls c;
  for (int i = 0; i < 5000; ++i) {
    switch (random() % 6) {
      case 0:
        c.centre_on({any(), any(), any()});
        break;
      case 1:
        c.roll(any());
        break;
      case 2:
        c.dolly(any());
        break;
      case 3:
        c.set_flying(random() % 2);
        break;
      case 4:
        c.set_scene(box_of({0.4f, 0.4f, 0.4f}), geometry::default_pose(), random() % 2 ? 0.3 : 0);
        break;
      default:
        c.reset();
    }
    const Pose p = c.advance(0.02);
    ASSERT_TRUE(geometry::validate(window_camera(p, 90, 640, 400, 0.02)).ok()) << i;
  }
}

// ---- keys and buttons ----

class HandTest : public testing::Test {
 protected:
  void tap(Key key) { i_.key(key, true), i_.key(key, false); }
  void drag(MouseButton button, double dx, double dy) {
    i_.move(0.5, 0.5);
    i_.button(button, true);
    i_.move(0.5 + dx, 0.5 + dy);
    i_.button(button, false);
  }
  Pose wait(double seconds = 1) {
    Pose p;
    for (int n = 0; n <= int(seconds * 60); ++n) p = i_.advance(now_s_ += 1.0 / 60, true);
    return p;
  }
  void click() {
    i_.button(MouseButton::kLeft, true);
    i_.button(MouseButton::kLeft, false);
  }
  double now_s_ = 100;
  Interaction i_{std::nullopt, Look{{splat::Kernel::kDisc, {true, true, true}}, true}};
};

TEST_F(HandTest, ARightDragZoomsAndWithShiftItTilts) {
  const Pose home = wait();
  drag(MouseButton::kRight, 0, -0.1);
  const Pose nearer = wait();
  EXPECT_LT(glm::length(nearer.position_room), 0.8 * glm::length(home.position_room));
  i_.key(Key::kShift, true);
  drag(MouseButton::kRight, 0.1, 0);
  i_.key(Key::kShift, false);
  const Pose tilted = wait();
  EXPECT_LT(glm::distance(tilted.position_room, nearer.position_room), 1e-6);
  EXPECT_NEAR(turn_between(tilted, nearer), 0.1 * kPi, 1e-4);
  i_.move(0.9, 0.9);
  EXPECT_LT(apart(wait(), tilted), 1e-6) << "the button is up";
}

TEST_F(HandTest, ADoubleClickAsksForTheCentreOnce) {
  wait(0.1);
  i_.move(0.4, 0.4);
  click();
  EXPECT_FALSE(i_.take(Wish::kCentre));
  click();
  EXPECT_TRUE(i_.take(Wish::kCentre));
  EXPECT_FALSE(i_.take(Wish::kCentre));
  click();
  EXPECT_FALSE(i_.take(Wish::kCentre)) << "the third click begins anew";
  wait(1);
  click();
  EXPECT_FALSE(i_.take(Wish::kCentre)) << "long ago";
  i_.move(0.6, 0.4);
  click();
  EXPECT_FALSE(i_.take(Wish::kCentre)) << "elsewhere";
}

TEST_F(HandTest, ShiftAndALetterNameASideAndItsOppositeAgain) {
  for (const char letter : {'X', 'Y', 'Z'})
    for (const bool negative : {false, true}) {
      EXPECT_TRUE(i_.shifted(letter));
      EXPECT_EQ(i_.take_side_wish(), (Side{letter - 'X', negative}));
      EXPECT_EQ(i_.take_side_wish(), std::nullopt);
    }
  EXPECT_FALSE(i_.shifted('W'));
  tap(Key::kF);
  EXPECT_FALSE(i_.shifted('X')) << "shift is faster flight";
  EXPECT_EQ(side_name({2, true}), "-Z");
}

TEST_F(HandTest, APathThatIsOverDoesNotHoldTheNextDataSet) {
  const auto path = [] {
    return geometry::Trajectory::of(
        {{0, geometry::look_at({0, 0, 2}, {0, 0, 0})}, {1, geometry::look_at({0.1, 0, 0.3}, {0, 0, 0})}});
  };
  const Pose home = geometry::look_at({0, 1, 3}, {0, 0, 0});
  i_.play(path());
  wait(0.5);
  i_.back_to_first_view();
  i_.set_scene(scene::Pipeline::kPoints, box_of({0.4f, 0.4f, 0.4f}), home);
  wait(0.2);
  EXPECT_TRUE(i_.playing()) << "it goes on";
  wait(3);
  i_.back_to_first_view();
  EXPECT_LT(apart(wait(2), home), 1e-4);
  EXPECT_FALSE(i_.playing());
}

}  // namespace
}  // namespace telesplat::viewer
