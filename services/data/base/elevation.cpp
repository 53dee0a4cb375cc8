#include "services/data/base/elevation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

namespace telesplat::data {
namespace {

struct Tint {
  float at;  // 0: 2nd percentile of land heights, 1: 98th
  std::array<float, 3> rgb;
};
// Hypsometric tints, in the usual order of atlases; muted, so that shading shows.
constexpr std::array<Tint, 7> kTints{{{0.00f, {96, 132, 82}},
                                      {0.18f, {148, 168, 100}},
                                      {0.36f, {206, 198, 132}},
                                      {0.54f, {196, 164, 108}},
                                      {0.72f, {160, 122, 92}},
                                      {0.88f, {176, 164, 156}},
                                      {1.00f, {244, 244, 246}}}};
constexpr uint32_t kSea = pack_rgb(70, 110, 150);
constexpr uint32_t kNone = ~uint32_t{0};

uint32_t tint(float at) {
  at = std::clamp(at, 0.0f, 1.0f);
  size_t i = 1;
  while (i + 1 < kTints.size() && at > kTints[i].at) ++i;
  const Tint &a = kTints[i - 1], &b = kTints[i];
  const float f = (at - a.at) / (b.at - a.at);
  const auto channel = [&](size_t c) { return uint32_t(a.rgb[c] + (b.rgb[c] - a.rgb[c]) * f + 0.5f); };
  return pack_rgb(channel(0), channel(1), channel(2));
}

struct Relief {
  float lo = 0, hi = 1;  // range of all heights
  float land_lo = 0, land_hi = 1;
  bool sea = false;
};

// Returns percentiles of heights; only of those above sea level where many lie exactly at or below it.
Relief relief_of(const ElevationRaster& raster) {
  std::vector<float> heights;
  const size_t stride = std::max<size_t>(raster.heights.size() / 1'000'000, 1);
  Relief out{3e38f, -3e38f};
  for (const float h : raster.heights)
    if (std::isfinite(h)) out.lo = std::min(out.lo, h), out.hi = std::max(out.hi, h);
  for (size_t i = 0; i < raster.heights.size(); i += stride)
    if (std::isfinite(raster.heights[i])) heights.push_back(raster.heights[i]);
  std::sort(heights.begin(), heights.end());
  const auto above = std::upper_bound(heights.begin(), heights.end(), 0.0f);
  const auto under = size_t(above - heights.begin());
  out.sea = raster.georeferenced && 50 * under >= heights.size() && under < heights.size();
  if (out.sea) heights.erase(heights.begin(), above);
  if (heights.empty()) return out;
  const auto at = [&](double f) { return heights[std::min(size_t(f * double(heights.size())), heights.size() - 1)]; };
  out.land_lo = at(0.02);
  out.land_hi = at(0.98);
  return out;
}

// vertex: index of each sample's vertex; kNone: no data.
void add_triangles(const ElevationRaster& raster, const std::vector<uint32_t>& vertex, Mesh& mesh) {
  const auto w = size_t(raster.width), h = size_t(raster.height);
  const bool mirrored = raster.along_row.x * raster.along_column.y > raster.along_row.y * raster.along_column.x;
  mesh.indices.reserve(6 * (w - 1) * (h - 1));
  for (size_t y = 0; y + 1 < h; ++y)
    for (size_t x = 0; x + 1 < w; ++x) {
      const size_t i = y * w + x;
      const uint32_t nw = vertex[i], ne = vertex[i + 1], sw = vertex[i + w], se = vertex[i + w + 1];
      const int have = (nw != kNone) + (ne != kNone) + (sw != kNone) + (se != kNone);
      const auto triangle = [&](uint32_t a, uint32_t b, uint32_t c) {
        mesh.indices.insert(mesh.indices.end(), {a, mirrored ? c : b, mirrored ? b : c});
      };
      if (have == 4) {
        // Cut along the diagonal whose ends differ less: ridges and valleys stay sharp.
        const auto z = [&](uint32_t v) { return mesh.positions[v].z; };
        if (std::abs(z(nw) - z(se)) <= std::abs(z(ne) - z(sw)))
          triangle(nw, sw, se), triangle(nw, se, ne);
        else
          triangle(nw, sw, ne), triangle(ne, sw, se);
      } else if (have == 3) {
        if (nw == kNone) triangle(ne, sw, se);
        if (ne == kNone) triangle(nw, sw, se);
        if (sw == kNone) triangle(nw, se, ne);
        if (se == kNone) triangle(nw, sw, ne);
      }
    }
}

}  // namespace

Result<Mesh> elevation_mesh(const ElevationRaster& raster, const ElevationOptions& options, const std::string& name) {
  const auto w = size_t(std::max(raster.width, 0)), h = size_t(std::max(raster.height, 0));
  if (w < 2 || h < 2) return Error{fmt::format("{}: a raster of {} x {} samples, at least 2 x 2", name, w, h)};
  if (raster.heights.size() != w * h)
    return Error{fmt::format("{}: {} heights for {} x {} samples", name, raster.heights.size(), w, h)};
  if (!std::isfinite(options.z_scale) || std::abs(options.z_scale) > 1e6)
    return Error{fmt::format("--z-scale {}: not finite, or beyond 1e6", options.z_scale)};
  const Relief relief = relief_of(raster);
  if (!(relief.hi >= relief.lo)) return Error{fmt::format("{}: none of its {} samples has data", name, w * h)};
  double z_scale = options.z_scale;
  if (z_scale == 0) {
    const double side =
        std::max(double(w) * glm::length(raster.along_row), double(h) * glm::length(raster.along_column));
    z_scale = raster.georeferenced || relief.hi == relief.lo ? 1 : side / 7 / (double(relief.hi) - relief.lo);
  }

  Mesh mesh;
  mesh.format = "raster", mesh.smooth = true;
  mesh.coordinates = raster.coordinates;
  mesh.notes = raster.notes;
  mesh.coordinates.shown.z *= z_scale;
  if (!raster.georeferenced) mesh.coordinates.lengths.z = z_scale;  // heights and pixels have no common unit
  std::vector<uint32_t> vertex(w * h, kNone);
  const float land = std::max(relief.land_hi - relief.land_lo, 1e-6f);
  for (size_t y = 0; y < h; ++y)
    for (size_t x = 0; x < w; ++x) {
      const size_t i = y * w + x;
      const float z = raster.heights[i];
      if (!std::isfinite(z)) continue;
      vertex[i] = uint32_t(mesh.positions.size());
      mesh.positions.emplace_back(raster.first + double(x) * raster.along_row + double(y) * raster.along_column,
                                  z * z_scale);
      mesh.colours.push_back(!raster.colours.empty() ? raster.colours[i]
                             : relief.sea && z <= 0  ? kSea
                                                     : tint((z - relief.land_lo) / land));
    }
  add_triangles(raster, vertex, mesh);
  if (mesh.indices.empty()) return Error{fmt::format("{}: no three neighbouring samples have data", name)};
  return mesh;
}

}  // namespace telesplat::data
