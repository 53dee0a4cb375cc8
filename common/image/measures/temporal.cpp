#include "common/image/measures/temporal.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <vector>

#include "common/image/measures/quality.h"
#include "common/parallel/in_parallel.h"

namespace telesplat::image {
namespace {

constexpr int kBlock = 8;            // pixels a side
constexpr double kPopping = 0.999;   // quantile over blocks
constexpr double kSamePlace = 0.01;  // largest difference, as a share of the depth

// Sum over the channels of |(d1 - d0) - (r1 - r0)|.
int change_error(uint32_t d0, uint32_t d1, uint32_t r0, uint32_t r1) {
  int sum = 0;
  for (const int shift : {16, 8, 0}) {
    const auto channel = [&](uint32_t c) { return static_cast<int>(c >> shift & 255); };
    sum += std::abs(channel(d1) - channel(d0) - channel(r1) + channel(r0));
  }
  return sum;
}

struct Block {
  int64_t counted_sum = 0, all_sum = 0;
  int counted = 0, all = 0;
};

Block block_at(const VerifiedFrame& before, const VerifiedFrame& after, int x0, int y0) {
  const int width = before.displayed.width, x1 = std::min(x0 + kBlock, width);
  const int y1 = std::min(y0 + kBlock, before.displayed.height);
  Block b;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      const size_t at = size_t(y) * width + x;
      const int e = change_error(before.displayed.colour[at], after.displayed.colour[at],
                                 before.reference.view.colour[at], after.reference.view.colour[at]);
      b.all_sum += e;
      ++b.all;
      if (!counts(before.reference, before.displayed, at) && !counts(after.reference, after.displayed, at)) continue;
      b.counted_sum += e;
      ++b.counted;
    }
  return b;
}

void check(const VerifiedFrame& frame) {
  const size_t pixels = size_t(frame.displayed.width) * frame.displayed.height;
  for (const View* v : {&frame.displayed, &frame.reference.view})
    CHECK(v->colour.size() == pixels && v->depth_m.size() == pixels);
  CHECK(frame.reference.hits.empty() || frame.reference.hits.size() == pixels);
}

// The pixel of `camera` that a point in room space falls into, and its depth.
struct Place {
  int x, y;
  double depth_m;
};

std::optional<Place> place_in(const geometry::Camera::PixelTransform& to_pixel, const geometry::Camera& camera,
                              const glm::dvec3& point_room) {
  const glm::dvec4 p(point_room, 1);
  const double depth = dot(to_pixel.w, p);
  if (!(depth >= camera.near_m)) return {};
  const double x = dot(to_pixel.x, p) / depth, y = dot(to_pixel.y, p) / depth;
  if (!(x >= 0 && y >= 0 && x < camera.width && y < camera.height)) return {};
  return Place{static_cast<int>(x), static_cast<int>(y), depth};
}

bool hole_around(const VerifiedFrame& frame, int x, int y) {
  const View& v = frame.displayed;
  for (int j = std::max(0, y - 1); j <= std::min(v.height - 1, y + 1); ++j)
    for (int i = std::max(0, x - 1); i <= std::min(v.width - 1, x + 1); ++i)
      if (is_hole(frame.reference.view, v, size_t(j) * v.width + i)) return true;
  return false;
}

}  // namespace

Unsteadiness unsteadiness(const VerifiedFrame& before, const VerifiedFrame& after) {
  check(before);
  check(after);
  CHECK(before.displayed.width == after.displayed.width && before.displayed.height == after.displayed.height);
  const int columns = (before.displayed.width + kBlock - 1) / kBlock;
  const int rows = (before.displayed.height + kBlock - 1) / kBlock;
  std::vector<Block> blocks(size_t(columns) * rows);
  in_parallel(tbb::blocked_range<int>(0, rows, 4), [&](const tbb::blocked_range<int>& range) {
    for (int row = range.begin(); row < range.end(); ++row)
      for (int column = 0; column < columns; ++column)
        blocks[size_t(row) * columns + column] = block_at(before, after, column * kBlock, row * kBlock);
  });
  Unsteadiness out;
  int64_t sum = 0;
  std::vector<double> means;
  for (const Block& b : blocks) {
    if (b.counted == 0) continue;
    sum += b.counted_sum;
    out.pixels += static_cast<size_t>(b.counted);
    means.push_back(static_cast<double>(b.all_sum) / (3.0 * b.all));
  }
  if (out.pixels == 0) return out;
  out.flicker = static_cast<double>(sum) / (3.0 * static_cast<double>(out.pixels));
  const auto rank = static_cast<size_t>(std::ceil(kPopping * static_cast<double>(means.size()))) - 1;
  std::nth_element(means.begin(), means.begin() + static_cast<ptrdiff_t>(rank), means.end());
  out.popping = means[rank];
  return out;
}

HoleFates follow_holes(const VerifiedFrame& before, const VerifiedFrame& after) {
  check(before);
  check(after);
  const auto to_pixel = after.camera.room_to_pixel();
  HoleFates out;
  for (int y = 0; y < before.displayed.height; ++y)
    for (int x = 0; x < before.displayed.width; ++x) {
      const size_t at = size_t(y) * before.displayed.width + x;
      if (!is_hole(before.reference.view, before.displayed, at)) continue;
      const auto point = before.camera.unproject(x + 0.5, y + 0.5, before.reference.view.depth_m[at]);
      const auto place = place_in(to_pixel, after.camera, point);
      if (!place) continue;
      const float there = after.reference.view.depth_m[size_t(place->y) * after.displayed.width + place->x];
      if (!(std::abs(there - place->depth_m) <= kSamePlace * place->depth_m)) continue;
      ++out.followed;
      out.closed += !hole_around(after, place->x, place->y);
    }
  return out;
}

}  // namespace telesplat::image
