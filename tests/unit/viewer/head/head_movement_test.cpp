// --trajectory, --eye, --look-at, --loop, --duration and --background: their effect, and values that are refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "client/viewer/display/headless_surface.h"
#include "client/viewer/viewer_options.h"
#include "common/geometry/fit.h"

namespace telesplat::viewer {
namespace {

const geometry::Box kBox{{-0.1f, -0.4f, -0.1f}, {0.1f, 0.4f, 0.1f}};

// The file of a trajectory of three seconds.
class File {
 public:
  File() : path_((std::filesystem::temp_directory_path() / "telesplat-head-movement-test.csv").string()) {
    std::ofstream(path_) << "t_s,px,py,pz,qw,qx,qy,qz\n5,0,0,1,1,0,0,0\n8,3,0,1,1,0,0,0\n";
  }
  ~File() { std::filesystem::remove(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

std::string refusal(ViewerOptions o) {
  const Status s = settle(o);
  return s ? "" : s.error().text;
}

TEST(HeadMovement, OrbitsWithoutAWindowAndStandsInOne) {
  ViewerOptions run, window;
  window.window.shown = true;
  ASSERT_TRUE(settle(run).ok() && settle(window).ok());
  EXPECT_EQ(run.head.trajectory, "orbit");
  EXPECT_EQ(window.head.trajectory, "still");
  EXPECT_EQ(run.display.span.duration_s, 10);
  EXPECT_EQ(window.display.span.duration_s, 0);
  ASSERT_TRUE(settle(run).ok()) << "what is settled can be settled again";
  EXPECT_EQ(run.head.trajectory, "orbit");
}

TEST(HeadMovement, AHeadlessOrbitFitsTheSceneAndStaysOnItsWayThen) {
  ViewerOptions o;
  o.size = "320x200";
  ASSERT_TRUE(settle(o).ok());
  HeadlessSurface surface(o.display, o.head.movement);
  Look look;
  surface.on_scene({kBox, scene::Pipeline::kPoints});
  const auto camera = surface.begin_frame(0, -1, look);
  EXPECT_EQ(camera.pose, geometry::fitted_orbit(kBox, camera).at(0));
  surface.on_scene({{kBox.lo * 2.0f, kBox.hi * 2.0f}, scene::Pipeline::kPoints});
  EXPECT_GT(glm::length(surface.begin_frame(0, -1, look).pose.position_room), glm::length(camera.pose.position_room));
  const auto moving = surface.begin_frame(0, 1, look);
  surface.on_scene({kBox, scene::Pipeline::kPoints});
  EXPECT_EQ(surface.begin_frame(0, 1, look).pose, moving.pose);
}

TEST(HeadMovement, TheTilesOfAWallFollowTheOrbitOfTheWhole) {
  ViewerOptions whole, tile;
  whole.size = "600x200", tile.size = "200x200", tile.wall.name = "3x1", tile.wall.tile = 2;
  ASSERT_TRUE(settle(whole).ok() && settle(tile).ok());
  HeadlessSurface all(whole.display, whole.head.movement), part(tile.display, tile.head.movement);
  Look look;
  all.on_scene({kBox, scene::Pipeline::kPoints});
  part.on_scene({kBox, scene::Pipeline::kPoints});
  EXPECT_EQ(all.begin_frame(0, 2, look).pose, part.begin_frame(0, 2, look).pose);
}

TEST(HeadMovement, AnEyeLooksAtTheDataUnlessTold) {
  ViewerOptions o;
  o.head.eye = "1, +2,-3";
  ASSERT_TRUE(settle(o).ok());
  EXPECT_EQ(o.head.trajectory, "still");
  const auto camera = geometry::make_camera({}, 90, 320, 200);
  const geometry::Box aside{{1, 0, 0}, {3, 2, 2}};
  EXPECT_EQ(o.head.movement.first_view(aside, camera), geometry::look_at({1, 2, -3}, {2, 1, 1}));
  EXPECT_EQ(o.head.movement.trajectory(aside, camera).at(7), geometry::look_at({1, 2, -3}, {2, 1, 1}));
  o.head.look_at = "1,9,-3";
  ASSERT_TRUE(settle(o).ok());  // straight up
  const auto up = o.head.movement.first_view(aside, camera);
  EXPECT_NEAR((up.orientation * glm::dvec3(0, 0, -1)).y, 1, 1e-12);
  // At the centre itself there is still a direction.
  o.head.eye = "2,1,1", o.head.look_at = "";
  ASSERT_TRUE(settle(o).ok());
  auto there = camera;
  there.pose = o.head.movement.first_view(aside, camera);
  EXPECT_TRUE(geometry::validate(there).ok());
}

TEST(HeadMovement, RefusesWhatContradictsItself) {
  ViewerOptions o;
  o.head.eye = "0,0,1", o.head.trajectory = "orbit";
  EXPECT_EQ(refusal(o), "--eye 0,0,1 and --trajectory orbit: the head stands at the one or follows the other");
  o.head.trajectory = "still";
  EXPECT_EQ(refusal(o), "");
  o.head.look_at = "0,0,1";
  EXPECT_EQ(refusal(o), "--eye 0,0,1 --look-at 0,0,1: are the same point, so there is no direction to look in");
  o.head.eye = "";
  EXPECT_EQ(refusal(o), "--look-at needs --eye, where to look from");
  ViewerOptions loop;
  loop.head.loop = true;
  EXPECT_EQ(refusal(loop), "--loop: --trajectory orbit has no end to begin again at; a file has");
  ViewerOptions misspelt;
  misspelt.head.trajectory = "orbitt";
  EXPECT_NE(refusal(misspelt).find("--trajectory orbitt: no such file"), std::string::npos) << refusal(misspelt);
  for (const char* bad : {"", "1,2", "1,2,3,4", "1,2,x", "nan,0,0", "1e9,0,0", "inf,0,0", "1,2,3 4"})
    EXPECT_FALSE(parse_point(bad).ok()) << bad;
}

TEST(HeadMovement, AFileLastsAsLongAsItIsAndItsEndIsSaid) {
  const File file;
  ViewerOptions o;
  o.head.trajectory = file.path();
  ASSERT_TRUE(settle(o).ok());
  EXPECT_DOUBLE_EQ(o.display.span.duration_s, 3);
  EXPECT_EQ(end_of_trajectory(o), "");
  o.display.span.hold_s = 2;
  ASSERT_TRUE(settle(o).ok());
  EXPECT_DOUBLE_EQ(o.display.span.duration_s, 5) << "all of it, then the head stands still";
  EXPECT_EQ(end_of_trajectory(o), "");
  o.display.span.hold_s = 0;
  o.head.duration_s = 10;
  ASSERT_TRUE(settle(o).ok());
  EXPECT_DOUBLE_EQ(o.display.span.duration_s, 10);
  EXPECT_EQ(end_of_trajectory(o), "the trajectory ends after 3.0 s; the head stands still then");
  o.head.loop = true;
  ASSERT_TRUE(settle(o).ok());
  EXPECT_EQ(end_of_trajectory(o), "the trajectory ends after 3.0 s; it begins again then");
  HeadlessSurface surface(o.display, o.head.movement);
  Look look;
  EXPECT_NEAR(surface.begin_frame(0, 4, look).pose.position_room.x, 1, 1e-9);
  o.head.duration_s = 2;
  ASSERT_TRUE(settle(o).ok());
  EXPECT_EQ(end_of_trajectory(o), "");
}

TEST(Background, ComesFromItsFlag) {
  ViewerOptions o;
  ASSERT_TRUE(settle(o).ok());
  EXPECT_EQ(o.display.shading.background, image::ShadingParameters{}.background) << "the default stays";
  EXPECT_FALSE(o.display.transparent);
  o.drawing.background = "#FFeedd";
  ASSERT_TRUE(settle(o).ok());
  EXPECT_EQ(o.display.shading.background, 0xffeeddu);
  o.drawing.background = "transparent";
  ASSERT_TRUE(settle(o).ok());
  EXPECT_TRUE(o.display.transparent);
  EXPECT_EQ(o.display.shading.background, 0u);
  o.drawing.background = "whitish";
  EXPECT_NE(refusal(o).find("--background whitish: not #rrggbb, transparent or one of white, black"), std::string::npos)
      << refusal(o);
}

}  // namespace
}  // namespace telesplat::viewer
