#include "services/sampler/volume/raycaster.h"

#include <tbb/blocked_range2d.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <optional>
#include <utility>

#include "common/parallel/in_parallel.h"
#include "common/volume/lighting.h"
#include "common/volume/warp/warper.h"

namespace telesplat::sampler {
namespace {

constexpr int kBrick = 8;             // cells a side; a cell lies between eight voxels
constexpr int kCorners = kBrick + 1;  // voxels a side: a brick has all voxels that it interpolates
constexpr uint32_t kAbsent = 0xffffffff;
constexpr double kEnough = 1e-6;  // a ray ends when less than this share of light is left

// Each voxel has its level in the low half, its normal in the high half.
using Brick = std::array<uint32_t, kCorners * kCorners * kCorners>;

int corner(int x, int y, int z) { return (z * kCorners + y) * kCorners + x; }

}  // namespace

struct VolumeRaycaster::Impl {
  volume::Grid grid;
  std::vector<volume::LevelColour> colours;
  bool lit = false;
  // Cells have the index of their lower corner, -1 to n - 1; brick (0, 0, 0) begins with cell (-1, -1, -1).
  std::array<int, 3> across{};
  std::vector<int32_t> index;  // index into bricks; -1: an empty brick
  std::vector<Brick> bricks;
  mutable tbb::task_arena arena;

  explicit Impl(int threads) : arena(threads > 0 ? threads : tbb::task_arena::automatic) {}

  size_t at(int x, int y, int z) const {
    return (size_t(z) * size_t(across[1]) + size_t(y)) * size_t(across[0]) + size_t(x);
  }
  void put(int i, int j, int k, uint32_t value);
  struct Light;
  struct Ray;
  std::optional<std::pair<double, double>> span_of(const Ray& ray) const;
  static double end_of(const std::array<int, 3>& brick, const Ray& ray, double leave);
  void march(const Light& light, const Ray& ray, glm::dvec3& colour, double& left, double& solid) const;
};

// Stores a voxel. It is a corner of the cells on both sides of it, so it goes into up to eight bricks.
void VolumeRaycaster::Impl::put(int i, int j, int k, uint32_t value) {
  const std::array<int, 3> p{i + 1, j + 1, k + 1};
  for (int which = 0; which < 8; ++which) {
    std::array<int, 3> brick, inside;
    bool there = true;
    for (size_t a = 0; a < 3; ++a) {
      brick[a] = p[a] / kBrick, inside[a] = p[a] % kBrick;
      if (which >> a & 1) {
        there = there && inside[a] == 0 && brick[a] > 0;
        --brick[a], inside[a] = kBrick;
      }
    }
    if (!there) continue;
    int32_t& slot = index[at(brick[0], brick[1], brick[2])];
    if (slot < 0) {
      slot = int32_t(bricks.size());
      bricks.emplace_back().fill(kAbsent);
    }
    bricks[size_t(slot)][size_t(corner(inside[0], inside[1], inside[2]))] = value;
  }
}

// Emission and absorption of voxels, seen from one eye.
struct VolumeRaycaster::Impl::Light {
  std::vector<glm::dvec4> level;  // r, g, b times extinction; extinction
  std::vector<float> intensity;   // by normal; empty: all 1

  glm::dvec4 of(uint32_t voxel) const {
    if (voxel == kAbsent) return glm::dvec4(0);
    glm::dvec4 out = level[voxel & 0xffff];
    if (!intensity.empty()) {
      const double i = intensity[voxel >> 16];
      out.x *= i, out.y *= i, out.z *= i;
    }
    return out;
  }
};

// Index coordinates start + t * direction, t in metres along the ray.
struct VolumeRaycaster::Impl::Ray {
  glm::dvec3 start, direction;
  double from, step;  // metres
};

// Returns the part of the ray, [enter, leave] in metres, within the grid and one voxel around it. nullopt: it misses.
std::optional<std::pair<double, double>> VolumeRaycaster::Impl::span_of(const Ray& ray) const {
  double enter = ray.from, leave = std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) {
    const double lo = -1, hi = grid.size[size_t(a)];
    if (std::abs(ray.direction[a]) < 1e-300) {
      if (ray.start[a] < lo || ray.start[a] > hi) return std::nullopt;
      continue;
    }
    const double t0 = (lo - ray.start[a]) / ray.direction[a], t1 = (hi - ray.start[a]) / ray.direction[a];
    enter = std::max(enter, std::min(t0, t1)), leave = std::min(leave, std::max(t0, t1));
  }
  if (!(enter < leave)) return std::nullopt;
  return std::pair(enter, leave);
}

// Returns t where the ray leaves the brick, `leave` at most.
double VolumeRaycaster::Impl::end_of(const std::array<int, 3>& brick, const Ray& ray, double leave) {
  double out = leave;
  for (int a = 0; a < 3; ++a) {
    if (std::abs(ray.direction[a]) < 1e-300) continue;
    const double side = (brick[size_t(a)] + (ray.direction[a] > 0)) * double(kBrick) - 1;
    out = std::min(out, (side - ray.start[a]) / ray.direction[a]);
  }
  return out;
}

void VolumeRaycaster::Impl::march(const Light& light, const Ray& ray, glm::dvec3& colour, double& left,
                                  double& solid) const {
  const auto span = span_of(ray);
  if (!span) return;
  const auto [enter, leave] = *span;
  const double unit = grid.unit_m(), length = ray.step / unit;  // length: of a step, in the unit of extinctions
  std::array<int, 3> cell{-9, -9, -9};
  std::array<glm::dvec4, 8> corners;
  bool empty = true;
  const int64_t steps = int64_t(std::ceil((leave - enter) / ray.step));
  for (int64_t n = 0; n < steps; ++n) {
    const double t = enter + (double(n) + 0.5) * ray.step;
    const glm::dvec3 p = ray.start + t * ray.direction;
    std::array<int, 3> c, brick, inside;
    glm::dvec3 f;
    for (int a = 0; a < 3; ++a) {
      const size_t s = size_t(a);
      c[s] = std::clamp(int(std::floor(p[a])), -1, grid.size[s] - 1);
      f[a] = std::clamp(p[a] - c[s], 0.0, 1.0);
      brick[s] = (c[s] + 1) / kBrick, inside[s] = (c[s] + 1) % kBrick;
    }
    if (c != cell) {
      const int32_t slot = index[at(brick[0], brick[1], brick[2])];
      if (slot < 0) {
        // Go on to the first step in another brick.
        n = std::max(n, int64_t(std::floor((end_of(brick, ray, leave) - enter) / ray.step - 0.5)));
        cell = {-9, -9, -9};
        continue;
      }
      const Brick& voxels = bricks[size_t(slot)];
      empty = true;
      for (int which = 0; which < 8; ++which) {
        const uint32_t voxel =
            voxels[size_t(corner(inside[0] + (which & 1), inside[1] + (which >> 1 & 1), inside[2] + (which >> 2 & 1)))];
        corners[size_t(which)] = light.of(voxel);
        empty = empty && corners[size_t(which)].w == 0;
      }
      cell = c;
    }
    if (empty) continue;
    const auto mix = [](const glm::dvec4& a, const glm::dvec4& b, double w) { return a + (b - a) * w; };
    const glm::dvec4 field = mix(mix(mix(corners[0], corners[1], f.x), mix(corners[2], corners[3], f.x), f.y),
                                 mix(mix(corners[4], corners[5], f.x), mix(corners[6], corners[7], f.x), f.y), f.z);
    if (!(field.w > 0)) continue;
    const double alpha = -std::expm1(-field.w * length);
    colour += left * alpha / field.w * glm::dvec3(field);
    left *= 1 - alpha;
    if (left < 1 - volume::kSolid && solid == std::numeric_limits<double>::infinity()) solid = t;
    if (left < kEnough) return;
  }
}

VolumeRaycaster::VolumeRaycaster(const volume::Grid& grid, const volume::Voxels& voxels,
                                 std::vector<volume::LevelColour> colours, int threads, const geometry::Clip& clip)
    : impl_(std::make_unique<Impl>(threads)) {
  Impl& impl = *impl_;
  impl.grid = grid;
  impl.colours = std::move(colours);
  impl.lit = !voxels.normal.empty();
  size_t count = 1;
  for (size_t a = 0; a < 3; ++a) {
    impl.across[a] = grid.size[a] / kBrick + 1;  // cells -1 to n - 1
    count *= size_t(impl.across[a]);
  }
  impl.index.assign(count, -1);
  size_t row = 0;
  for (int k = voxels.k_begin; k < voxels.k_end; ++k)
    for (int j = 0; j < grid.size[1]; ++j, ++row)
      for (uint32_t n = voxels.rows[row]; n < voxels.rows[row + 1]; ++n) {
        const uint16_t level = voxels.level[n];
        if (level >= impl.colours.size() || !(impl.colours[level].extinction > 0)) continue;
        // As in the splatter: the margin keeps voxels that lie in a plane, however they are rounded.
        const glm::dvec3 room(grid.index_to_room * glm::dvec4(voxels.i[n], j, k, 1));
        if (!clip.empty() && !clip.keeps(room, 1e-6 * grid.unit_m())) continue;
        impl.put(voxels.i[n], j, k, level | uint32_t(impl.lit ? voxels.normal[n] : volume::kNoNormal) << 16);
      }
}

VolumeRaycaster::~VolumeRaycaster() = default;

image::View VolumeRaycaster::draw(const geometry::Camera& camera, uint32_t background, double step) const {
  const Impl& impl = *impl_;
  Impl::Light light;
  for (const volume::LevelColour& c : impl.colours)
    light.level.push_back(glm::dvec4(glm::dvec3(c.r, c.g, c.b) * double(c.extinction), c.extinction));
  const glm::dvec3 eye = camera.pose.position_room;
  if (impl.lit) light.intensity = volume::normal_intensities(impl.grid, eye);

  const glm::dmat4 to_index = impl.grid.room_to_index();
  double side = std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) side = std::min(side, glm::length(glm::dvec3(impl.grid.index_to_room[a])));
  const glm::dvec3 start = to_index * glm::dvec4(eye, 1);

  image::View out;
  out.width = camera.width, out.height = camera.height;
  out.colour.resize(size_t(camera.width) * size_t(camera.height));
  out.depth_m.resize(out.colour.size());
  const auto pixel = [&](int x, int y) {
    // One metre of depth along the pixel's ray, which is `per_depth` metres long.
    const glm::dvec3 ray = camera.unproject(x + 0.5, y + 0.5, 1) - eye;
    const double per_depth = glm::length(ray);
    const glm::dvec3 direction = to_index * glm::dvec4(ray / per_depth, 0);
    glm::dvec3 colour(0);
    double left = 1, solid = std::numeric_limits<double>::infinity();
    impl.march(light, {start, direction, camera.near_m * per_depth, step * side}, colour, left, solid);
    const auto channel = [&](int shift, double value) {
      const double sum = 255 * value + left * double(background >> shift & 255);
      return uint32_t(std::clamp(sum + 0.5, 0.0, 255.0)) << shift;
    };
    const size_t at = size_t(y) * size_t(camera.width) + size_t(x);
    const auto covered = uint32_t(std::clamp(255 * (1 - left) + 0.5, 0.0, 255.0));
    out.colour[at] = covered << 24 | channel(16, colour.x) | channel(8, colour.y) | channel(0, colour.z);
    out.depth_m[at] = float(solid / per_depth);
  };
  impl.arena.execute([&] {
    in_parallel(tbb::blocked_range2d<int>(0, camera.height, 8, 0, camera.width, 64), [&](const auto& range) {
      for (int y = range.rows().begin(); y < range.rows().end(); ++y)
        for (int x = range.cols().begin(); x < range.cols().end(); ++x) pixel(x, y);
    });
  });
  return out;
}

}  // namespace telesplat::sampler
