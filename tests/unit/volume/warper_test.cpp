#include "common/volume/warp/warper.h"

#include <gtest/gtest.h>

#include "tests/support/volume/frames.h"

namespace telesplat::volume {
namespace {

using testing::blob_frame, testing::channel, testing::difference, testing::frame_of, testing::looking_at,
    testing::orbit;
using testing::turned_grid, testing::warp_by_rays, testing::WarpedView;

constexpr uint32_t kBackground = 0x203040;

WarpedView warped(const VolumeFrame* frame, const geometry::Camera& camera, int threads = 1,
                  WarpStats* stats = nullptr) {
  WarpedView out(camera);
  Warper warper(threads);
  const WarpStats made = warper.render(frame, camera, kBackground, out.target());
  if (stats) *stats = made;
  return out;
}

// A grid of unit voxels seen along -z; the frame's pixels are the display's, upside down.
struct Straight {
  Grid grid{{40, 30, 16}, glm::dmat4(1)};
  geometry::Camera camera;
  ShearFrame shear;

  explicit Straight(int layers, int width = 80, int height = 60) {
    camera = geometry::make_camera({{19.5, 14.5, 60}, {1, 0, 0, 0}}, 50, width, height);
    shear.axis = 2, shear.direction = -1, shear.eye = camera.pose.position_room;
    shear.width = width, shear.height = height;
    shear.u0 = camera.left, shear.du = 1 / camera.focal_x();
    shear.v0 = camera.bottom, shear.dv = 1 / camera.focal_y();
    for (int l = 0; l < layers; ++l) {
      const int end = 16 - l * 16 / layers, begin = 16 - (l + 1) * 16 / layers;
      shear.layers.push_back({begin, end, (begin + end - 1) / 2.0});
    }
    EXPECT_TRUE(validate(shear, grid));
  }
  SliceImage plain(int layer, uint32_t pixel) const {
    const auto pixels = static_cast<size_t>(shear.width) * static_cast<size_t>(shear.height);
    return {layer, 0, 16, {0, 0, shear.width, shear.height}, std::vector<uint32_t>(pixels, pixel)};
  }
};

TEST(VolumeWarper, OneOpaqueLayerSeenFromWhereItWasSampledIsItself) {
  Straight s(1, 203, 151);
  SliceImage image = s.plain(0, 0);
  std::mt19937 random(1);
  for (auto& pixel : image.pixels) pixel = 0xff000000u | (random() & 0xffffff);
  const VolumeFrame frame = frame_of(s.grid, s.shear, {image});
  const WarpedView view = warped(&frame, s.camera);
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x)
      ASSERT_EQ(view.colour[view.at(x, y)], image.pixels[view.at(x, view.height - 1 - y)]) << x << ", " << y;
}

TEST(VolumeWarper, LayersSeenFromWhereTheyWereSampledAreComposited) {
  Straight s(4);
  std::vector<SliceImage> images;
  for (int l = 0; l < 4; ++l) images.push_back(testing::blobs(s.shear, l, {0, 0, s.shear.width, s.shear.height}));
  const VolumeFrame frame = frame_of(s.grid, s.shear, images);
  const WarpedView view = warped(&frame, s.camera);
  int transparent = 0, opaque = 0;
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x) {
      double sum[4] = {};
      for (const auto& image : images)
        for (int c = 0; c < 4; ++c) {
          const double left = 1 - sum[3] / 255;
          sum[c] += (c == 3 ? 1 - sum[3] / 255 : left) * channel(image.pixels[view.at(x, view.height - 1 - y)], 8 * c);
        }
      (sum[3] == 0 ? transparent : opaque) += sum[3] == 0 || sum[3] == 255;
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(channel(view.colour[view.at(x, y)], 8 * c),
                    sum[c] + (1 - sum[3] / 255) * channel(kBackground, 8 * c), 1.01)
            << x << ", " << y;
    }
  EXPECT_GT(transparent, 100);
  EXPECT_GT(opaque, 100);
}

TEST(VolumeWarper, AgreesWithRaysThroughPlanesFromEverywhere) {
  const Grid grid = turned_grid();
  for (int n = 0; n < 24; ++n) {
    const double around = 0.7 * n, above = 0.5 * std::sin(1.3 * n);
    const auto sampled = looking_at(grid.centre_room(), orbit(grid, 0.9, around, above), 150, 110);
    const VolumeFrame frame = blob_frame(grid, sampled);
    // Beside, nearer, farther, from behind, and turned.
    const double aside = n % 4 == 3 ? 3.0 : 0.1 * (n % 4);
    auto display = looking_at(grid.centre_room(), orbit(grid, 0.6 + 0.02 * n, around + aside, above + 0.05), 140, 100);
    display.pose.orientation = display.pose.orientation * glm::angleAxis(0.3 * (n % 5), glm::dvec3(0, 0, 1));
    const WarpedView view = warped(&frame, display);
    double sum = 0;
    int depths_off = 0, shown = 0;
    for (int y = 0; y < view.height; ++y)
      for (int x = 0; x < view.width; ++x) {
        const auto [colour, depth] = warp_by_rays(frame, display, kBackground, x, y);
        const int off = difference(colour, view.colour[view.at(x, y)]);
        ASSERT_LE(off, 4) << n << ": " << x << ", " << y;  // weights are rounded to 128ths, of edges of up to 255
        sum += off;
        shown += std::isfinite(depth);
        const float got = view.depth_m[view.at(x, y)];
        depths_off += !(std::isinf(depth) ? std::isinf(got) : std::abs(got - depth) < 1e-4);
      }
    EXPECT_LT(sum / (view.width * view.height), 0.3) << n;
    EXPECT_GT(shown, 500) << n;
    EXPECT_LT(depths_off, 1 + shown / 50) << n;  // where rounding decides whether the opacity reaches kSolid
  }
}

TEST(VolumeWarper, WorksWithEyesAmongTheLayersAndPlanesSeenEdgeOn) {
  const Grid grid = turned_grid();
  const auto sampled = looking_at(grid.centre_room(), orbit(grid, 0.8, 0.1, 0.1), 150, 110);
  const VolumeFrame frame = blob_frame(grid, sampled);
  const glm::dvec3 along = grid.index_to_room * glm::dvec4(1, 0, 0, 0), centre = grid.centre_room();
  int edge_on = 0;
  for (int n = 0; n < 12; ++n) {
    const glm::dvec3 eye = centre + (n - 6) * 0.011 * glm::normalize(glm::dvec3(grid.index_to_room[frame.shear.axis]));
    const auto display = looking_at(eye + along, eye, 150, 110, 100);  // looks along the planes
    const WarpedView view = warped(&frame, display);
    int off = 0;
    for (int y = 0; y < view.height; ++y)
      for (int x = 0; x < view.width; ++x) {
        const auto [colour, depth] = warp_by_rays(frame, display, kBackground, x, y);
        edge_on += std::isfinite(depth);
        off += difference(colour, view.colour[view.at(x, y)]) > 8;
      }
    // Near a plane's horizon a pixel holds many texels, and chance decides which of them it shows.
    EXPECT_LT(off, 150 * 110 / 50) << n;
  }
  EXPECT_GT(edge_on, 1000);
}

TEST(VolumeWarper, PlanesLieBehindEachOtherByDistanceFromWhereverTheEyeIs) {
  const Straight s(4);
  const VolumeFrame frame = frame_of(s.grid, s.shear, {s.plain(0, 1), s.plain(1, 1), s.plain(2, 1), s.plain(3, 1)});
  using Order = std::vector<int>;
  EXPECT_EQ(front_to_back(frame, {0, 0, 60}), (Order{0, 1, 2, 3}));
  EXPECT_EQ(front_to_back(frame, {5, 5, -30}), (Order{3, 2, 1, 0}));
  EXPECT_EQ(front_to_back(frame, {0, 0, 8}), (Order{1, 2, 0, 3}));  // planes at 13.5, 9.5, 5.5, 1.5
  EXPECT_EQ(front_to_back(frame, {0, 0, 9.5}), (Order{0, 2, 3}));
  EXPECT_EQ(front_to_back(VolumeFrame{}, {0, 0, 0}), Order{});
}

TEST(VolumeWarper, NearerLayersHideFartherOnesFromBothSides) {
  Straight s(2);
  const VolumeFrame frame = frame_of(s.grid, s.shear, {s.plain(0, 0xffff0000u), s.plain(1, 0xff00ff00u)});
  const WarpedView front = warped(&frame, s.camera);
  EXPECT_EQ(front.colour[front.at(40, 30)], 0xffff0000u);
  EXPECT_NEAR(front.depth_m[front.at(40, 30)], 60 - 11.5, 1e-3);
  geometry::Camera behind = s.camera;
  behind.pose = {{19.5, 14.5, -40}, glm::angleAxis(3.14159265358979323846, glm::dvec3(0, 1, 0))};
  const WarpedView back = warped(&frame, behind);
  EXPECT_EQ(back.colour[back.at(40, 30)], 0xff00ff00u);
  EXPECT_NEAR(back.depth_m[back.at(40, 30)], 40 + 3.5, 1e-3);
}

TEST(VolumeWarper, DepthIsWhereOpacityReachesAQuarter) {
  Straight s(4);
  // 30 of 255 thrice: 0.118, 0.222, 0.313.
  const VolumeFrame frame =
      frame_of(s.grid, s.shear, {s.plain(0, 0x1e000000u), s.plain(1, 0x1e000000u), s.plain(2, 0x1e000000u)});
  const WarpedView view = warped(&frame, s.camera);
  EXPECT_NEAR(view.depth_m[view.at(3, 7)], 60 - 5.5, 1e-3);
  const VolumeFrame thin = frame_of(s.grid, s.shear, {s.plain(0, 0x1e000000u), s.plain(1, 0x1e000000u)});
  const WarpedView none = warped(&thin, s.camera);
  EXPECT_EQ(none.depth_m[none.at(3, 7)], std::numeric_limits<float>::infinity());
}

TEST(VolumeWarper, NothingIsBackground) {
  const Straight s(2);
  geometry::Camera away = s.camera;
  away.pose.orientation = glm::angleAxis(3.14159265358979323846, glm::dvec3(0, 1, 0));
  const VolumeFrame empty = frame_of(s.grid, s.shear, {}), shown = frame_of(s.grid, s.shear, {s.plain(0, 0xffffffffu)});
  for (const auto& [frame, camera] :
       {std::pair<const VolumeFrame*, geometry::Camera>{nullptr, s.camera}, {&empty, s.camera}, {&shown, away}}) {
    WarpStats stats;
    const WarpedView view = warped(frame, camera, 1, &stats);
    EXPECT_EQ(stats.samples, 0u);
    for (const uint32_t colour : view.colour) ASSERT_EQ(colour, kBackground);  // covered by no layer
    for (const float depth : view.depth_m) ASSERT_EQ(depth, std::numeric_limits<float>::infinity());
  }
}

TEST(VolumeWarper, ImagesFadeWithinAPixelOfTheirBorder) {
  Straight s(1);
  SliceImage image{0, 0, 16, {20, 20, 20, 20}, std::vector<uint32_t>(400, 0xffffffffu)};
  const VolumeFrame frame = frame_of(s.grid, s.shear, {image});
  geometry::Camera half = s.camera;  // moved right by half a pixel
  half.left += 0.5 * s.shear.du, half.right += 0.5 * s.shear.du;
  const WarpedView view = warped(&frame, half);
  const auto grey = [&](int x) { return channel(view.colour[view.at(x, 30)], 0); };
  EXPECT_EQ(grey(18), 0x40);
  EXPECT_NEAR(grey(19), (0x40 + 255) / 2, 1);
  EXPECT_EQ(grey(20), 255);
  EXPECT_EQ(grey(38), 255);
  EXPECT_NEAR(grey(39), (0x40 + 255) / 2, 1);
  EXPECT_EQ(grey(40), 0x40);
}

// Skipping empty and hidden pixels changes no pixel; nor does the number of threads.
TEST(VolumeWarper, ThreadsDrawTheSamePixels) {
  const Grid grid = turned_grid();
  const auto sampled = looking_at(grid.centre_room(), orbit(grid, 0.9, 0.4, 0.2), 400, 300);
  const VolumeFrame frame = blob_frame(grid, sampled);
  const auto display = looking_at(grid.centre_room(), orbit(grid, 0.8, 0.5, 0.25), 411, 307);
  const WarpedView one = warped(&frame, display, 1), three = warped(&frame, display, 3);
  EXPECT_EQ(one.colour, three.colour);
  EXPECT_EQ(one.depth_m, three.depth_m);
}

// The parts of a wall meet without a seam.
TEST(VolumeWarper, CroppedViewsAreTheWholeViewsPixels) {
  const Grid grid = turned_grid();
  std::mt19937 random(5);
  const auto below = [&](int limit) { return static_cast<int>(random() % static_cast<unsigned>(limit)); };
  for (int n = 0; n < 20; ++n) {
    const auto sampled = looking_at(grid.centre_room(), orbit(grid, 0.9, 0.4 * n, 0.2), 300, 200);
    const VolumeFrame frame = blob_frame(grid, sampled);
    auto whole =
        looking_at(grid.centre_room(), orbit(grid, 0.8, 0.4 * n + 0.1, 0.25), 301 + n, 200 + 3 * n, 60 + 0.7 * n);
    if (n % 2) whole.left -= 0.1371, whole.right += 0.2113, whole.top += 0.07;
    const WarpedView all = warped(&frame, whole);
    for (int r = 0; r < 8; ++r) {
      const int x = below(whole.width - 20), y = below(whole.height - 20);
      const geometry::Rect rect{x, y, 20 + below(whole.width - 20 - x + 1), 20 + below(whole.height - 20 - y + 1)};
      const WarpedView part = warped(&frame, geometry::crop(whole, rect));
      for (int j = 0; j < rect.height; ++j)
        for (int i = 0; i < rect.width; ++i) {
          ASSERT_EQ(part.colour[part.at(i, j)], all.colour[all.at(x + i, y + j)]) << n << ": " << i << ", " << j;
          ASSERT_EQ(part.depth_m[part.at(i, j)], all.depth_m[all.at(x + i, y + j)]) << n << ": " << i << ", " << j;
        }
    }
  }
}

}  // namespace
}  // namespace telesplat::volume
