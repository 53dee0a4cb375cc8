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

uint32_t tint(float at) {
  at = std::clamp(at, 0.0f, 1.0f);
  size_t i = 1;
  while (i + 1 < kTints.size() && at > kTints[i].at) ++i;
  const Tint &a = kTints[i - 1], &b = kTints[i];
  const float f = (at - a.at) / (b.at - a.at);
  const auto channel = [&](size_t c) { return uint32_t(a.rgb[c] + (b.rgb[c] - a.rgb[c]) * f + 0.5f); };
  return pack_rgb(channel(0), channel(1), channel(2));
}

// Returns percentiles of heights; only of those above sea level where many lie exactly at or below it.
ElevationGrid::Relief relief_of(const ElevationRaster& raster) {
  std::vector<float> heights;
  const size_t stride = std::max<size_t>(raster.heights.size() / 1'000'000, 1);
  ElevationGrid::Relief out{3e38f, -3e38f};
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

}  // namespace

Result<std::shared_ptr<const ElevationGrid>> ElevationGrid::make(ElevationRaster raster,
                                                                 const ElevationOptions& options,
                                                                 const std::string& name) {
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
  Facts facts{.format = "raster", .vertices = w * h, .triangles = 2 * (w - 1) * (h - 1), .smooth = true};
  facts.colours = true;
  facts.unused =
      uint64_t(std::count_if(raster.heights.begin(), raster.heights.end(), [](float z) { return !std::isfinite(z); }));
  facts.notes = raster.notes;
  facts.coordinates = raster.coordinates;
  facts.coordinates.shown.z *= z_scale;
  if (!raster.georeferenced) facts.coordinates.lengths.z = z_scale;  // heights and pixels have no common unit
  return std::shared_ptr<const ElevationGrid>(new ElevationGrid(std::move(facts), std::move(raster), relief, z_scale));
}

glm::dvec3 ElevationGrid::position(uint64_t vertex) const {
  const uint64_t w = uint64_t(raster_.width);
  return {raster_.first + double(vertex % w) * raster_.along_row + double(vertex / w) * raster_.along_column,
          raster_.heights[vertex] * z_scale_};
}

uint32_t ElevationGrid::colour(uint64_t vertex) const {
  if (!raster_.colours.empty()) return raster_.colours[vertex];
  const float z = raster_.heights[vertex];
  if (relief_.sea && z <= 0) return kSea;
  return tint((z - relief_.land_lo) / std::max(relief_.land_hi - relief_.land_lo, 1e-6f));
}

bool ElevationGrid::corners(uint64_t first, size_t count, uint32_t* out) const {
  const bool mirrored = raster_.along_row.x * raster_.along_column.y > raster_.along_row.y * raster_.along_column.x;
  for (uint64_t t = first; t < first + count; ++t, out += 3) {
    const Triangle corners = triangle(t);
    out[0] = corners[0], out[1] = corners[mirrored ? 2 : 1], out[2] = corners[mirrored ? 1 : 2];
  }
  return true;
}

// A cell has the triangles 2 n and 2 n + 1.
ElevationGrid::Triangle ElevationGrid::triangle(uint64_t t) const {
  const uint64_t w = uint64_t(raster_.width), cell = t / 2;
  const uint64_t at = cell / (w - 1) * w + cell % (w - 1);
  const auto nw = uint32_t(at), ne = uint32_t(at + 1), sw = uint32_t(at + w), se = uint32_t(at + w + 1);
  const auto z = [&](uint32_t v) { return raster_.heights[v] * z_scale_; };
  const bool has[4] = {std::isfinite(z(nw)), std::isfinite(z(ne)), std::isfinite(z(sw)), std::isfinite(z(se))};
  const int have = has[0] + has[1] + has[2] + has[3];
  const bool second = t % 2 == 1;
  if (have < 3 || (have == 3 && second)) return {kNoTriangle, kNoTriangle, kNoTriangle};
  if (have == 3)
    return !has[0]   ? Triangle{ne, sw, se}
           : !has[1] ? Triangle{nw, sw, se}
           : !has[2] ? Triangle{nw, se, ne}
                     : Triangle{nw, sw, ne};
  // Cut along the diagonal whose ends differ less: ridges and valleys stay sharp.
  if (std::abs(z(nw) - z(se)) <= std::abs(z(ne) - z(sw))) return second ? Triangle{nw, se, ne} : Triangle{nw, sw, se};
  return second ? Triangle{ne, sw, se} : Triangle{nw, sw, ne};
}

Result<Mesh> elevation_mesh(ElevationRaster raster, const ElevationOptions& options, const std::string& name) {
  const auto made = ElevationGrid::make(std::move(raster), options, name);
  if (!made) return made.error();
  const ElevationGrid& grid = **made;
  Mesh mesh;
  mesh.format = grid.facts().format, mesh.smooth = true;
  mesh.coordinates = grid.facts().coordinates;
  mesh.notes = grid.facts().notes;
  std::vector<uint32_t> vertex(grid.vertices(), ~uint32_t{0});
  mesh.positions.reserve(grid.vertices() - grid.facts().unused);
  for (uint64_t v = 0; v < grid.vertices(); ++v) {
    const glm::dvec3 p = grid.position(v);
    if (!std::isfinite(p.z)) continue;
    vertex[v] = uint32_t(mesh.positions.size());
    mesh.positions.push_back(p);
    mesh.colours.push_back(grid.colour(v));
  }
  mesh.indices.reserve(3 * grid.triangles());
  for (uint64_t t = 0; t < grid.triangles(); ++t) {
    uint32_t corners[3];
    grid.corners(t, 1, corners);
    if (corners[0] == RandomMesh::kNoTriangle) continue;
    for (const uint32_t corner : corners) mesh.indices.push_back(vertex[corner]);
  }
  if (mesh.indices.empty()) return Error{fmt::format("{}: no three neighbouring samples have data", name)};
  return mesh;
}

}  // namespace telesplat::data
