// Points for splatting tests: clusters made by hand, and an oracle that splats them in the simplest way.
#pragma once

#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <vector>

#include "common/image/normal.h"
#include "common/splat/cpu_splatter.h"
#include "common/splat/flat/splat_table.h"
#include "common/splat/tile_binning.h"
#include "tests/support/finish_plainly.h"

namespace telesplat::testing {

/// One mosaic level with its cluster, filled point by point; each array has an allocation of exactly its size.
class HandMadeItem {
 public:
  explicit HandMadeItem(const geometry::Box& leaf) : cluster_(std::make_unique<points::Cluster>()) {
    cluster_->leaf_room = leaf;
  }

  void add(uint16_t x, uint16_t y, uint16_t z, uint32_t colour, uint16_t normal = image::encode_normal16({0, 0, 1})) {
    x_.push_back(x), y_.push_back(y), z_.push_back(z), normal_.push_back(normal), colour_.push_back(colour);
  }
  /// Adds the point of the leaf's grid nearest to `position_room`, which must lie in the leaf.
  void add_at(const glm::dvec3& position_room, uint32_t colour, uint16_t normal = image::encode_normal16({0, 0, 1})) {
    const geometry::Box& b = cluster_->leaf_room;
    const auto q = [](double p, float lo, float hi) {
      return static_cast<uint16_t>(std::clamp(std::floor((p - lo) / (double(hi) - lo) * 65536.0), 0.0, 65535.0));
    };
    add(q(position_room.x, b.lo.x, b.hi.x), q(position_room.y, b.lo.y, b.hi.y), q(position_room.z, b.lo.z, b.hi.z),
        colour, normal);
  }
  splat::DrawItem item(float splat_px) {
    x_.shrink_to_fit(), y_.shrink_to_fit(), z_.shrink_to_fit(), normal_.shrink_to_fit(), colour_.shrink_to_fit();
    return {cluster_.get(),
            {static_cast<uint32_t>(x_.size()), x_.data(), y_.data(), z_.data(), normal_.data(), colour_.data()},
            splat_px};
  }

 private:
  std::unique_ptr<points::Cluster> cluster_;
  std::vector<uint16_t> x_, y_, z_, normal_;
  std::vector<uint32_t> colour_;
};

inline splat::DrawList draw_list(std::vector<splat::DrawItem> items) {
  splat::DrawList list;
  list.items = std::move(items);
  for (const auto& item : list.items) list.points += item.level.count;
  return list;
}

struct Frame {
  int width, height;
  std::vector<uint32_t> colour;
  std::vector<float> depth_m;
  Frame(int w, int h) : width(w), height(h), colour(size_t(w) * h, 0x12345678), depth_m(size_t(w) * h, -1.0f) {}
  splat::FrameTarget target() { return {width, height, colour.data(), depth_m.data()}; }
  uint32_t at(int x, int y) const { return colour[size_t(y) * width + x]; }
  bool operator==(const Frame&) const = default;
};

/// Looks along -z from the origin, 90 degrees wide.
inline geometry::Camera front_camera(int width, int height) {
  return geometry::make_camera({}, 90, width, height, 0.1);
}

inline image::Shading unlit(const geometry::Camera& camera, uint32_t background = 0x00010203) {
  image::ShadingParameters p;
  p.lit = false;
  p.background = background;
  return {p, camera};
}

/// Makes `count` items of random points in boxes around the camera's axis, some behind the camera.
inline std::vector<HandMadeItem> random_items(uint32_t seed, int count, int most_points) {
  std::mt19937 rng(seed);
  const auto uniform = [&](float lo, float hi) { return std::uniform_real_distribution<float>(lo, hi)(rng); };
  std::vector<HandMadeItem> items;
  for (int i = 0; i < count; ++i) {
    const glm::vec3 lo(uniform(-1.2f, 1.0f), uniform(-0.9f, 0.7f), uniform(-2.0f, 0.1f));
    HandMadeItem item({lo, lo + glm::vec3(uniform(0.01f, 0.4f))});
    const int n = std::uniform_int_distribution<int>(1, most_points)(rng);
    for (int j = 0; j < n; ++j)
      item.add(uint16_t(rng()), uint16_t(rng()), uint16_t(rng()), rng() & 0xffffff, uint16_t(rng()));
    items.push_back(std::move(item));
  }
  return items;
}

/// Splats one point after the other, one pixel after the other, by the formulas of splat_kernels.h, splat_table.h and
/// pixel_key.h. A finish follows tests/support/finish_plainly.h: pixels beyond the image are empty.
inline Frame splat_plainly(const splat::DrawList& list, const geometry::Camera& camera, splat::Kernel kernel,
                           const image::Shading& shading, const splat::Finish& finish = {false, false, false}) {
  Frame frame(camera.width, camera.height);
  std::vector<uint64_t> keys(frame.colour.size(), ~uint64_t{0});
  const auto near_m = static_cast<float>(camera.near_m);
  const bool disc = kernel == splat::Kernel::kDisc;
  double bias_sum[4] = {}, points[4] = {};
  for (const splat::DrawItem& item : list.items) {
    const splat::LeafTransform t = splat::leaf_transform(camera.room_to_pixel(), item.cluster->leaf_room);
    const float size = std::clamp(std::ceil(item.splat_px * 4) / 4, 1.0f, 16.0f);
    const int side = int(std::ceil(size)), steps = side == 1 ? 1 : side <= 4 ? 8 : 4;
    const double contour_r2 = (disc ? 0.25 : 0.5) * size * size;
    const uint32_t spacing = disc ? splat::spacing_class(item.splat_px / list.scale) : 0;
    bias_sum[spacing] += item.level.count * (side > 1 ? splat::splat_bias(contour_r2, side, camera.focal_x()) : 0.0);
    points[spacing] += item.level.count;
    for (uint32_t i = 0; i < item.level.count; ++i) {
      const float p[3] = {float(item.level.x[i]), float(item.level.y[i]), float(item.level.z[i])};
      const auto row = [&](const std::array<float, 4>& r) {
        return ((p[0] * r[0] + p[1] * r[1]) + p[2] * r[2]) + r[3];
      };
      const float w = row(t.w);
      if (!(w >= near_m)) continue;
      const float shift = float(steps) * 0.5f * float(1 - side);
      const float fixed_x = row(t.x) * (float(steps) / w) + shift, fixed_y = row(t.y) * (float(steps) / w) + shift;
      if (!(std::abs(fixed_x) < 1e6f && std::abs(fixed_y) < 1e6f)) continue;
      const int fx = int(std::floor(fixed_x)), fy = int(std::floor(fixed_y));
      const int x0 = int(std::floor(double(fx) / steps)), y0 = int(std::floor(double(fy) / steps));
      const double cx = (fx - x0 * steps + 0.5) / steps + 0.5 * (side - 1),
                   cy = (fy - y0 * steps + 0.5) / steps + 0.5 * (side - 1);
      for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
          if (x0 + x < 0 || y0 + y < 0 || x0 + x >= frame.width || y0 + y >= frame.height) continue;
          const double dx = x + 0.5 - cx, dy = y + 0.5 - cy, r2 = dx * dx + dy * dy;
          const bool inside = disc ? r2 <= contour_r2 : std::abs(dx) <= 0.5 * size && std::abs(dy) <= 0.5 * size;
          if (side > 1 && !inside && !(x == int(cx) && y == int(cy))) continue;
          const uint32_t bias = side > 1 ? splat::splat_bias(r2, side, camera.focal_x()) : 0;
          uint64_t& key = keys[size_t(y0 + y) * frame.width + x0 + x];
          key = std::min(key, splat::encode_key(splat::encode_depth_code(w, near_m) + bias, spacing,
                                                side > 1 ? splat::ring_of(r2 / contour_r2) : 0, item.level.normal[i],
                                                item.level.colour[i] & 0xffffff));
        }
    }
  }
  splat::RimBias rim{};
  for (int i = 0; i < 4; ++i)
    if (points[i] > 0) rim[i] = uint32_t(std::floor(bias_sum[i] / points[i] + 0.5));
  OwnTile tile(frame.width, frame.height);
  std::fill(tile.words.begin(), tile.words.end(), shading.background());
  for (int y = -tile.tile.margin; y < frame.height + tile.tile.margin; ++y)
    for (int x = -tile.tile.margin; x < frame.width + tile.tile.margin; ++x) tile.tile.info(y)[x] = splat::kEmptyInfo;
  for (size_t i = 0; i < keys.size(); ++i) {
    if (keys[i] == ~uint64_t{0}) continue;
    const int x = int(i) % frame.width, y = int(i) / frame.width;
    tile.tile.info(y)[x] = splat::key_info(keys[i]);
    tile.tile.colour(y)[x] =
        image::Shading::apply(splat::key_albedo(keys[i]), shading.table()[splat::key_normal(keys[i])]);
  }
  if (finish.fill) fill_plainly(tile, 2, splat::gaps_to_fill(finish));
  if (finish.smooth) smooth_plainly(tile, 1);
  if (finish.antialias) antialias_plainly(tile);
  for (size_t i = 0; i < keys.size(); ++i) {
    const int x = int(i) % frame.width, y = int(i) / frame.width;
    frame.colour[i] = 0xff000000u | tile.colour(x, y);
    frame.depth_m[i] = tile.empty(x, y)
                           ? std::numeric_limits<float>::infinity()
                           : splat::decode_depth_code(splat::unbiased_depth_code(tile.info(x, y), rim), near_m);
  }
  return frame;
}

}  // namespace telesplat::testing
