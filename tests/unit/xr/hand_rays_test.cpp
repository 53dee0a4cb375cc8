// Rays of controllers in pictures.
#include "client/displays/xr/hands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace telesplat::viewer {
namespace {

constexpr uint32_t kGrey = 0x808080, kBlue = 0x0000ff;

// A wall two metres before the camera, in the left half of the picture.
image::View wall(const geometry::Camera& camera) {
  const size_t pixels = size_t(camera.width) * size_t(camera.height);
  image::View out{camera.width, camera.height, std::vector<uint32_t>(pixels, kGrey),
                  std::vector<float>(pixels, std::numeric_limits<float>::infinity())};
  for (int y = 0; y < camera.height; ++y) std::fill_n(out.depth_m.begin() + y * camera.width, camera.width / 2, 2.0f);
  return out;
}

TEST(HandRays, MeetWhatThePictureShows) {
  const auto camera = geometry::make_camera({}, 90, 200, 200);
  const auto picture = wall(camera);
  const auto hit = first_hit(picture, camera, {-0.5, -0.3, 0}, {0, 0, -1});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->z, -2, 1e-3);
  EXPECT_NEAR(hit->x, -0.5, 1e-9);
  EXPECT_FALSE(first_hit(picture, camera, {0.5, -0.3, 0}, {0, 0, -1})) << "there is nothing on that side";
  EXPECT_FALSE(first_hit(picture, camera, {0, 0, 0}, {0, 0, 1})) << "nor behind the camera";
}

TEST(HandRays, LinesHideBehindWhatIsBeforeThem) {
  const auto camera = geometry::make_camera({}, 90, 200, 200);
  auto picture = wall(camera);
  draw_line(picture, camera, {-0.5, 0, -1}, {-0.5, 0, -5}, kBlue);
  const auto blue = [&](double x, double depth_m) {
    const int px = int(camera.focal_x() * x / depth_m + 100);
    return picture.colour[size_t(100 * 200 + px)] == kBlue;
  };
  EXPECT_TRUE(blue(-0.5, 1.5));
  EXPECT_FALSE(blue(-0.5, 4.5));
  EXPECT_LT(*std::min_element(picture.depth_m.begin(), picture.depth_m.end()), 1.1f) << "the line has its depth";
}

TEST(HandRays, LinesFromBehindTheCameraAreWhole) {
  const auto camera = geometry::make_camera({}, 90, 200, 200);
  auto picture = wall(camera);
  draw_line(picture, camera, {0.3, -0.3, 0.2}, {0.3, -0.3, -5}, kBlue);
  for (int y = 108; y < 200; ++y) {
    const auto row = picture.colour.begin() + y * 200;
    EXPECT_NE(std::find(row, row + 200, kBlue), row + 200) << "row " << y;
  }
  EXPECT_EQ(std::count(picture.colour.begin(), picture.colour.begin() + 95 * 200, kBlue), 0);
}

}  // namespace
}  // namespace telesplat::viewer
