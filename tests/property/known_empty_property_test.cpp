// Seen and unseen space against brute force over all cells and rays, in random views.
#include <gtest/gtest.h>

#include <limits>

#include "services/packer/points/plan/known_empty.h"
#include "tests/support/points_scenes.h"

namespace telesplat::packer {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kWidth = 160, kHeight = 100, kCells = 1 << KnownEmpty::kCellLevel;

const points::ModelConfig kModel = test::scene_config();

struct Bounds {
  double left = 1e30, right = -1e30, top = 1e30, bottom = -1e30, nearest = 1e30, farthest = -1e30;
};

// Projects a cube of `side` metres at `lo`.
Bounds bounds_of(const geometry::Camera::PixelTransform& t, const glm::dvec3& lo, double side) {
  Bounds out;
  for (int i = 0; i < 8; ++i) {
    const glm::dvec4 p(lo + side * glm::dvec3(i & 1, i >> 1 & 1, i >> 2 & 1), 1);
    const double w = glm::dot(t.w, p), x = glm::dot(t.x, p) / w, y = glm::dot(t.y, p) / w;
    out.left = std::min(out.left, x), out.right = std::max(out.right, x);
    out.top = std::min(out.top, y), out.bottom = std::max(out.bottom, y);
    out.nearest = std::min(out.nearest, w), out.farthest = std::max(out.farthest, w);
  }
  return out;
}

struct Scene {
  KnownEmpty space{kModel};
  const glm::dvec3 lo = points::octree_grid(kModel).lo;

  bool block_unseen(const glm::ivec3& block) const {
    for (int i = 0; i < 8; ++i)
      if (!space.unseen(2 * block + glm::ivec3(i & 1, i >> 1 & 1, i >> 2 & 1))) return false;
    return true;
  }
};

geometry::Camera random_camera(std::mt19937_64& random) {
  return test::scene_camera(test::random_eye(random), kWidth, kHeight);
}

// Returns depths of a view; some rectangles have no rays.
std::vector<float> random_clear(const geometry::Camera& camera, std::mt19937_64& random) {
  const image::DepthImage image = test::sample_scene(camera, {0, 0, kWidth, kHeight});
  std::vector<float> out(image.pixels(), kInfinity);
  for (size_t i = 0; i < out.size(); ++i)
    if (image.depth[i] != 0) out[i] = static_cast<float>(image::decode_depth(image.depth[i], camera.near_m));
  for (int n = 0; n < 4; ++n) {
    const int x0 = static_cast<int>(random() % kWidth), y0 = static_cast<int>(random() % kHeight);
    for (int y = y0; y < std::min(y0 + 20, kHeight); ++y)
      for (int x = x0; x < std::min(x0 + 30, kWidth); ++x) out[static_cast<size_t>(y * kWidth + x)] = 0;
  }
  return out;
}

// Returns the least depth in the rectangle of pixels that a cell touches; 0 outside the image.
double least_touched(const std::vector<float>& clear_m, const Bounds& b) {
  const auto x0 = static_cast<int>(std::floor(b.left - 0.05)), x1 = static_cast<int>(std::floor(b.right + 0.05)),
             y0 = static_cast<int>(std::floor(b.top - 0.05)), y1 = static_cast<int>(std::floor(b.bottom + 0.05));
  if (x0 < 0 || y0 < 0 || x1 >= kWidth || y1 >= kHeight) return 0;
  double out = kInfinity;
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x)
      out = std::min(out, static_cast<double>(clear_m[static_cast<size_t>(y * kWidth + x)]));
  return out;
}

// Returns the least depth of rays in the rectangle around a cell; rays up to `slack` outside of it may count or not.
double least_of_rays(const std::vector<float>& clear_m, const Bounds& b, double slack) {
  double out = kInfinity;
  for (int y = std::max(0, static_cast<int>(b.top) - 1); y <= b.bottom && y < kHeight; ++y)
    for (int x = std::max(0, static_cast<int>(b.left) - 1); x <= b.right && x < kWidth; ++x)
      if (x + 0.5 > b.left + slack && x + 0.5 < b.right - slack && y + 0.5 > b.top + slack &&
          y + 0.5 < b.bottom - slack)
        out = std::min(out, static_cast<double>(clear_m[static_cast<size_t>(y * kWidth + x)]));
  return out;
}

TEST(KnownEmptyProperty, CellsAreCarvedIfAndOnlyIfAllRaysPassedThem) {
  for (uint64_t seed = 0; seed < 6; ++seed) {
    std::mt19937_64 random(seed);
    Scene scene;
    const geometry::Camera camera = random_camera(random);
    const std::vector<float> clear_m = random_clear(camera, random);
    std::vector<glm::ivec3> cells;
    for (int i = 0; i < 200000; ++i) {
      const glm::ivec3 cell(random() % kCells, random() % kCells, random() % kCells);
      if (scene.space.unseen(cell)) cells.push_back(cell);
    }
    ASSERT_GT(cells.size(), 10000u);
    scene.space.carve(camera, clear_m, seed % 2 ? 1 : 4);
    const auto t = camera.room_to_pixel();
    const double side = scene.space.cell_m();
    size_t carved = 0, wrong = 0, left = 0;
    for (const glm::ivec3& cell : cells) {
      const Bounds b = bounds_of(t, scene.lo + glm::dvec3(cell) * side, side);
      const bool seen = !scene.space.unseen(cell);
      carved += seen;
      // Slack: single precision, a hundredth of a pixel.
      wrong += seen && !(least_of_rays(clear_m, b, 0.01) > b.farthest - 1e-5);
      if (seen) continue;
      // A node about half a pixel large is carved as a whole or not at all.
      glm::ivec3 at = cell;
      Bounds node = b;
      for (double longer = side; longer < 0.1; at /= 2) {
        const Bounds next = bounds_of(t, scene.lo + glm::dvec3(at) * longer, longer);
        if (longer > side && (next.right - next.left > 0.65 || next.bottom - next.top > 0.65)) break;
        node = next;
        longer *= 2;
      }
      left += least_touched(clear_m, node) > node.farthest + 1e-5;
    }
    EXPECT_EQ(wrong, 0u) << seed;
    EXPECT_EQ(left, 0u) << seed;
    EXPECT_GT(carved, cells.size() / 20) << seed;
  }
}

// Checks every block that hides something: the ray nearest its middle must be set, rays a pixel beside the rectangle
// around it may not.
void check_projection(const Scene& scene, const geometry::Camera& camera, const std::vector<float>& shown_m,
                      const image::PixelMask& mask) {
  const auto t = camera.room_to_pixel();
  const double side = 2 * scene.space.cell_m();
  image::PixelMask most(kWidth, kHeight);
  size_t lacking = 0;
  for (int z = 0; z < kCells / 2; ++z)
    for (int y = 0; y < kCells / 2; ++y)
      for (int x = 0; x < kCells / 2; ++x) {
        if (!scene.block_unseen({x, y, z})) continue;
        const Bounds b = bounds_of(t, scene.lo + glm::dvec3(x, y, z) * side, side);
        if (b.nearest < camera.near_m) continue;
        for (int py = std::max(0, static_cast<int>(b.top) - 1); py <= b.bottom + 1 && py < kHeight; ++py)
          for (int px = std::max(0, static_cast<int>(b.left) - 1); px <= b.right + 1 && px < kWidth; ++px)
            if (shown_m[static_cast<size_t>(py * kWidth + px)] > b.farthest - 1e-5) most.set(px, py);
        if (b.right - b.left < 0.4 && b.bottom - b.top < 0.4) continue;  // nodes of several blocks stand for them
        const glm::dvec4 centre(scene.lo + (glm::dvec3(x, y, z) + 0.5) * side, 1);
        const double w = glm::dot(t.w, centre), cx = glm::dot(t.x, centre) / w, cy = glm::dot(t.y, centre) / w;
        if (!(cx >= 0 && cx < kWidth && cy >= 0 && cy < kHeight)) continue;
        const auto px = static_cast<int>(cx), py = static_cast<int>(cy);
        lacking += shown_m[static_cast<size_t>(py * kWidth + px)] > b.farthest + 1e-5 && !mask.at(px, py);
      }
  EXPECT_EQ(lacking, 0u);
  size_t beyond = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) beyond += mask.at(x, y) && !most.at(x, y);
  EXPECT_EQ(beyond, 0u);
}

TEST(KnownEmptyProperty, ThePixelsOfUnseenBlocksAreSet) {
  for (uint64_t seed = 0; seed < 3; ++seed) {
    std::mt19937_64 random(100 + seed);
    Scene scene;
    for (uint64_t i = 0; i < 3 * seed; ++i) {
      const geometry::Camera camera = random_camera(random);
      const image::DepthImage image = test::sample_scene(camera, {0, 0, kWidth, kHeight});
      scene.space.add(points::prepare_patch(kModel, {i + 1}, camera, {0, 0, kWidth, kHeight}, image));
      scene.space.carve(camera, random_clear(camera, random), 2);
    }
    const geometry::Camera camera = random_camera(random);
    const std::vector<float> shown_m = random_clear(camera, random);
    image::PixelMask mask, again;
    scene.space.project(camera, shown_m, 1, mask);
    scene.space.project(camera, shown_m, 4, again);
    EXPECT_EQ(mask, again);
    EXPECT_GT(mask.count(), 0u);
    check_projection(scene, camera, shown_m, mask);
  }
}

}  // namespace
}  // namespace telesplat::packer
