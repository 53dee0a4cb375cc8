// Eyes of a display's head: their places, the views sampled for them, and the pictures composed of theirs.
#include <gtest/gtest.h>

#include <fstream>

#include "client/viewer/display/eyes/eye_pictures.h"
#include "client/viewer/display/eyes/eye_rig.h"
#include "client/viewer/stereo_flags.h"
#include "client/viewer/viewer_options.h"
#include "common/geometry/stereo.h"
#include "tests/support/eye_cameras.h"
#include "tests/support/files/own_folder.h"

namespace telesplat::viewer {
namespace {

const geometry::Box kScene{{-0.4f, -0.3f, -0.4f}, {0.4f, 0.3f, 0.4f}};

geometry::Camera head_at(double z) {
  return geometry::make_camera(geometry::look_at({0, 0.2, z}, {0, 0, 0}), 80, 640, 400);
}

TEST(EyeRig, TheScreenIsAsFarAsTheScenesMiddleInTheFirstFrame) {
  EyeRig rig({.mode = stereo::Mode::kSideBySide});
  const double first_m = std::hypot(0.2, 1.5), later_m = std::hypot(0.2, 0.8);
  EXPECT_NEAR(rig.eyes(head_at(0.8), -1, kScene).screen_m, later_m, 1e-6) << "the head rests: nothing is settled";
  EXPECT_NEAR(rig.eyes(head_at(1.5), 0, kScene).screen_m, first_m, 1e-6);
  EXPECT_NEAR(rig.eyes(head_at(0.8), 1, kScene).screen_m, first_m, 1e-6) << "and stays there";
  EyeRig told({.mode = stereo::Mode::kSideBySide, .screen_m = 0.6});
  EXPECT_EQ(told.eyes(head_at(1.5), 0, kScene).screen_m, 0.6);
}

TEST(EyeRig, EyesAreThoseOfTheHead) {
  EyeRig rig({.mode = stereo::Mode::kRows, .eye_separation_m = 0.07, .screen_m = 0.9});
  const geometry::Camera head = head_at(1);
  const EyePair pair = rig.eyes(head, 0, kScene);
  const auto expected = geometry::eye_cameras(head, 0.07, 0.9);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_LT(glm::distance(pair.eyes[i].pose.position_room, expected[i].pose.position_room), 1e-12);
    EXPECT_NEAR(pair.eyes[i].left, expected[i].left, 1e-12);
    EXPECT_NEAR(pair.eyes[i].top, expected[i].top, 1e-12);
  }
  EXPECT_LT(glm::distance(pair.head.pose.position_room, head.pose.position_room), 1e-12);
  const EyePair again = recorded_eyes(rig.options(), head, pair.screen_m,
                                      {pair.eyes[0].pose.position_room, pair.eyes[1].pose.position_room});
  EXPECT_EQ(again.eyes[0], pair.eyes[0]);
  EXPECT_EQ(again.eyes[1], pair.eyes[1]);
}

TEST(EyeRig, SamplersAreAskedForWhatBothSeeOfTheScene) {
  EyeRig rig({.mode = stereo::Mode::kSideBySide, .screen_m = 1});
  const EyePair pair = rig.eyes(head_at(1), 0, kScene);
  const geometry::Camera asked = EyeRig::sampled(pair, kScene);
  EXPECT_EQ(asked.pose, pair.head.pose);
  EXPECT_LT(asked.left, pair.head.left);
  EXPECT_GT(asked.right, pair.head.right);
  EXPECT_LT(asked.right - asked.left, 1.1 * (pair.head.right - pair.head.left));
  EXPECT_NEAR(asked.focal_x() / pair.head.focal_x(), 1, 0.01);
}

TEST(EyeRig, APanelIsAWindowIntoAScaledRoom) {
  stereo::Panel panel;
  panel.width = 320, panel.height = 200, panel.pixel_m = 2e-3, panel.eye = {64, 64}, panel.distance_m = 0.8;
  StereoOptions o{.mode = stereo::Mode::kAutostereo, .screen_m = 1.6, .panel = panel};
  const double fov_deg = 2 * std::atan(0.32 / 0.8) * 180 / 3.14159265358979323846;
  const geometry::Camera head = geometry::make_camera(geometry::look_at({0, 0, 1}, {0, 0, 0}), fov_deg, 64, 64);
  EyeRig rig(o);
  // The screen is twice as far away in the room: all lengths there are twice as large.
  const EyePair pair = rig.eyes(head, 0, kScene);
  EXPECT_NEAR(glm::distance(pair.eyes[0].pose.position_room, pair.eyes[1].pose.position_room), 0.128, 1e-9);
  EXPECT_NEAR((pair.head.top - pair.head.bottom) / (pair.head.right - pair.head.left), 200.0 / 320, 1e-9);
  const auto before = stereo::eyes_of(panel, pair.eyes);
  EXPECT_LT(glm::distance(before[0], glm::dvec3(-0.032, 0, 0.8)), 1e-9);
  EXPECT_LT(glm::distance(before[1], glm::dvec3(0.032, 0, 0.8)), 1e-9);
  // A tracked head: the eyes follow its place and its turn.
  o.tracked_head = geometry::Trajectory::still({{0.1, -0.05, 0.7}, glm::angleAxis(0.5, glm::dvec3(0, 0, 1))});
  EyeRig tracking(o);
  const auto tracked = stereo::eyes_of(panel, tracking.eyes(head, 0, kScene).eyes);
  EXPECT_LT(glm::distance(0.5 * (tracked[0] + tracked[1]), glm::dvec3(0.1, -0.05, 0.7)), 1e-9);
  EXPECT_NEAR(tracked[1].y - tracked[0].y, 0.064 * std::sin(0.5), 1e-9);
}

TEST(EyeRig, AWallsScreenIsWhereItIsAndEyesLieBesideEachOtherAsTheHeadTurns) {
  // A screen to the right of the head, seen from 0.8 m.
  const double width_m = 0.5, distance_m = 0.8;
  const geometry::Pose facing{{1, 2, 3}, glm::angleAxis(-1.2, glm::dvec3(0, 1, 0))};
  geometry::Camera camera = geometry::make_camera(facing, 60, 320, 200);
  camera.left = (-0.2 * width_m) / distance_m, camera.right = (0.8 * width_m) / distance_m;
  EyeRig rig({.mode = stereo::Mode::kRows, .eye_separation_m = 0.07, .screen_m = 9, .screen_width_m = width_m});
  const glm::dquat turned = glm::angleAxis(0.3, glm::dvec3(0, 0, 1));
  const EyePair pair = rig.eyes(camera, turned, 0, kScene);
  EXPECT_NEAR(pair.screen_m, distance_m, 1e-9);
  const glm::dvec3 apart = pair.eyes[1].pose.position_room - pair.eyes[0].pose.position_room;
  EXPECT_LT(glm::distance(apart, turned * glm::dvec3(0.07, 0, 0)), 1e-9);
  // Both eyes see the screen's corners at the edges of their pictures.
  const geometry::Screen screen = geometry::screen_before(camera, distance_m);
  EXPECT_NEAR(screen.width_m, width_m, 1e-9);
  for (const auto& eye : pair.eyes) {
    const auto expected = geometry::camera_through(screen, eye.pose.position_room, 320, 200, camera.near_m);
    EXPECT_NEAR(eye.left, expected.left, 1e-9);
    EXPECT_NEAR(eye.top, expected.top, 1e-9);
  }
}

TEST(EyeRig, SwappedEyesSwapTheirPlaces) {
  const std::array<image::View, 2> views{image::View{2, 1, {1, 1}, {}}, image::View{2, 1, {2, 2}, {}}};
  image::View out;
  EyeRig({.mode = stereo::Mode::kSideBySide}).compose({}, views, false, out);
  EXPECT_EQ(out.colour, (std::vector<uint32_t>{1, 1, 2, 2}));
  EyeRig({.mode = stereo::Mode::kSideBySide, .swap_eyes = true}).compose({}, views, false, out);
  EXPECT_EQ(out.colour, (std::vector<uint32_t>{2, 2, 1, 1}));
}

// In every mode, the middle of the display, or of its left half, is the middle of a picture.
TEST(EyePictures, APlaceOfTheDisplayIsOneOfItsPicture) {
  struct Case {
    stereo::Mode mode;
    int width, height;
    glm::dvec2 middle;
  };
  for (const Case& c :
       {Case{stereo::Mode::kQuadBuffer, 640, 400, {320, 200}}, Case{stereo::Mode::kRows, 640, 400, {320, 200}},
        Case{stereo::Mode::kSideBySide, 1280, 400, {320, 200}}, Case{stereo::Mode::kTopBottom, 640, 800, {320, 200}}}) {
    EyePictures eyes({.mode = c.mode, .screen_m = 1});
    eyes.begin(0, head_at(1), head_at(1).pose.orientation, 0, kScene);
    const geometry::Camera display = eyes.display(head_at(1));
    EXPECT_EQ(display.width, c.width);
    EXPECT_EQ(display.height, c.height);
    const auto aim = eyes.aim(head_at(1), eyes.pair(), {c.middle.x / display.width, c.middle.y / display.height});
    EXPECT_LT(glm::distance(aim.at_pix, glm::dvec2(320, 200)), 1e-9) << int(c.mode);
    const bool parted = c.width > 640 || c.height > 400;
    EXPECT_EQ(aim.camera, parted ? eyes.pair().eyes[0] : eyes.pair().head) << int(c.mode);
  }
}

// While the display waits the head moves on; a place asked for belongs to the frame on display.
TEST(EyePictures, APlaceIsThatOfTheFrameOnDisplay) {
  EyePictures eyes({.mode = stereo::Mode::kSideBySide, .screen_m = 1});
  eyes.begin(0, head_at(1), head_at(1).pose.orientation, 0, kScene);
  const EyePair shown = eyes.pair();
  eyes.begin(1, head_at(0.5), head_at(0.5).pose.orientation, 1, kScene);
  EXPECT_EQ(eyes.aim(head_at(1), shown, {0.75, 0.5}).camera, shown.eyes[1]);
  EXPECT_NE(eyes.pair().eyes[1], shown.eyes[1]);
}

TEST(StereoFlags, WhatCannotBeIsRefused) {
  const auto refusal = [](const StereoFlags& f) {
    const auto o = settle(f);
    return o ? std::string() : o.error().text;
  };
  EXPECT_EQ(refusal({}), "");
  EXPECT_EQ(refusal({.mode = "checker", .pattern = "test"}), "");
  EXPECT_EQ(refusal({.mode = "autostereo"}),
            "--stereo autostereo: needs --barrier, a file of the display's line screen");
  EXPECT_NE(refusal({.mode = "rows", .panel_file = "a.toml"}).find("is for --stereo autostereo"), std::string::npos);
  EXPECT_EQ(refusal({.pattern = "test"}), "--stereo-pattern test: needs --stereo");
  EXPECT_NE(refusal({.mode = "autostereo", .panel_file = "/nowhere.toml"}).find("/nowhere.toml"), std::string::npos);
}

TEST(StereoFlags, APanelSetsSizeAndFieldOfView) {
  const std::string path = tests::own_folder() + "panel.toml";
  std::ofstream(path) << "[panel]\npixels = [400, 300]\npixel_mm = 1\ndistance_m = 0.4\neye = [200, 150]\n"
                         "[lines]\npitch_mm = 2\nthickness_mm = 3\n";
  ViewerOptions o;
  o.stereo.mode = "autostereo";
  o.stereo.panel_file = path;
  const Status s = settle(o);
  ASSERT_TRUE(s) << s.error().text;
  EXPECT_EQ(o.display.width, 400);
  EXPECT_EQ(o.display.height, 300);
  EXPECT_NEAR(o.display.fov_deg, 2 * std::atan(0.5) * 180 / 3.14159265358979, 1e-6);
  EXPECT_EQ(o.display.stereo.eye_size(400, 300), (stereo::Size{200, 150}));
}

}  // namespace
}  // namespace telesplat::viewer
