#include "common/splat/tile_binning.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace telesplat::splat {
namespace {

// Bounds of a leaf's cube on the screen, in pixels; unbounded if it reaches nearer than the near plane.
struct Footprint {
  float x0, x1, y0, y1;
  float nearest, farthest;
};

// Least and greatest of eight; compares halves as a whole, which the compiler vectorises.
std::pair<float, float> extremes(const float (&v)[8]) {
  float lo[4], hi[4];
  for (int i = 0; i < 4; ++i) lo[i] = v[i] < v[i + 4] ? v[i] : v[i + 4];
  for (int i = 0; i < 4; ++i) hi[i] = v[i] > v[i + 4] ? v[i] : v[i + 4];
  return {std::min(std::min(lo[0], lo[1]), std::min(lo[2], lo[3])),
          std::max(std::max(hi[0], hi[1]), std::max(hi[2], hi[3]))};
}

Footprint project_cube(const LeafTransform& t) {
  // Corners 0 and 65536 on each axis: the eight sums of the rows' entries.
  static constexpr float kX[8] = {0, 65536, 0, 65536, 0, 65536, 0, 65536},
                         kY[8] = {0, 0, 65536, 65536, 0, 0, 65536, 65536},
                         kZ[8] = {0, 0, 0, 0, 65536, 65536, 65536, 65536};
  float x[8], y[8], w[8];
  for (int i = 0; i < 8; ++i) w[i] = t.w[0] * kX[i] + t.w[1] * kY[i] + t.w[2] * kZ[i] + t.w[3];
  for (int i = 0; i < 8; ++i) x[i] = (t.x[0] * kX[i] + t.x[1] * kY[i] + t.x[2] * kZ[i] + t.x[3]) / w[i];
  for (int i = 0; i < 8; ++i) y[i] = (t.y[0] * kX[i] + t.y[1] * kY[i] + t.y[2] * kZ[i] + t.y[3]) / w[i];
  const auto [x0, x1] = extremes(x);
  const auto [y0, y1] = extremes(y);
  const auto [nearest, farthest] = extremes(w);
  return {x0, x1, y0, y1, nearest, farthest};
}

}  // namespace

geometry::Rect TileGrid::rect(int index) const {
  const int x = index % columns() * tile_width, y = index / columns() * tile_height;
  return {x, y, std::min(tile_width, width - x), std::min(tile_height, height - y)};
}

LeafTransform leaf_transform(const geometry::Camera::PixelTransform& t, const geometry::Box& leaf) {
  const glm::dvec3 step = (glm::dvec3(leaf.hi) - glm::dvec3(leaf.lo)) / 65536.0;
  const glm::dvec3 first = glm::dvec3(leaf.lo) + 0.5 * step;
  const auto fold = [&](const glm::dvec4& row) {
    return std::array<float, 4>{static_cast<float>(row.x * step.x), static_cast<float>(row.y * step.y),
                                static_cast<float>(row.z * step.z),
                                static_cast<float>(row.x * first.x + row.y * first.y + row.z * first.z + row.w)};
  };
  return {fold(t.x), fold(t.y), fold(t.w)};
}

void TileBinning::build(const TileGrid& grid, std::span<const LeafTransform> transforms, float near_m,
                        float margin_px) {
  begin(grid, transforms.size(), near_m, margin_px);
  for (size_t i = 0; i < transforms.size(); ++i) place(i, transforms[i]);
  list();
}

void TileBinning::begin(const TileGrid& grid, size_t boxes, float near_m, float margin_px) {
  grid_ = grid;
  near_m_ = near_m;
  margin_px_ = margin_px + 1.0f;  // 1: for rounding, here and in the projection of points
  ranges_.resize(boxes);
}

void TileBinning::place(size_t box, const LeafTransform& transform, float reach, float most_px) {
  const Footprint f = project_cube(transform);
  const auto last_column = static_cast<float>(grid_.columns() - 1), last_row = static_cast<float>(grid_.rows() - 1);
  const float per_column = 1.0f / static_cast<float>(grid_.tile_width),
              per_row = 1.0f / static_cast<float>(grid_.tile_height);
  Range& r = ranges_[box];
  r = {1, 0, 1, 0, false};
  if (!(f.farthest >= near_m_)) return;
  // A cube that reaches nearer than half the near plane has no bounded footprint: it goes into all tiles. Such cubes,
  // right before the eye, are rare.
  if (!(f.nearest > 0.5f * near_m_)) {
    r = {0, static_cast<int16_t>(last_column), 0, static_cast<int16_t>(last_row), false};
    return;
  }
  // Points nearer than the near plane are not drawn.
  const float margin = margin_px_ + std::min(reach / std::max(f.nearest, near_m_), most_px);
  const float x0 = f.x0 - margin, x1 = f.x1 + margin, y0 = f.y0 - margin, y1 = f.y1 + margin;
  const auto width = static_cast<float>(grid_.width), height = static_cast<float>(grid_.height);
  if (x1 < 0 || y1 < 0 || x0 > width || y0 > height) return;
  const float c0 = std::floor(x0 * per_column), c1 = std::floor(x1 * per_column);
  const float r0 = std::floor(y0 * per_row), r1 = std::floor(y1 * per_row);
  r = {static_cast<int16_t>(std::max(c0, 0.0f)), static_cast<int16_t>(std::min(c1, last_column)),
       static_cast<int16_t>(std::max(r0, 0.0f)), static_cast<int16_t>(std::min(r1, last_row)), false};
  r.whole = c0 == c1 && r0 == r1 && c0 >= 0 && r0 >= 0 && x1 < width && y1 < height && f.nearest > near_m_ * 1.0001f;
}

void TileBinning::list() {
  first_.assign(static_cast<size_t>(grid_.count()) + 1, 0);
  for (const Range& r : ranges_)
    for (int row = r.row0; row <= r.row1; ++row)
      for (int column = r.column0; column <= r.column1; ++column) ++first_[row * grid_.columns() + column + 1];
  for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  next_.assign(first_.begin(), first_.end() - 1);
  entries_.resize(first_.back());
  for (size_t i = 0; i < ranges_.size(); ++i) {
    const Range& r = ranges_[i];
    for (int row = r.row0; row <= r.row1; ++row)
      for (int column = r.column0; column <= r.column1; ++column)
        entries_[next_[row * grid_.columns() + column]++] = {static_cast<uint32_t>(i), r.whole};
  }
}

}  // namespace telesplat::splat
