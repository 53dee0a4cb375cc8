#include "tools/make_terrain/terrain.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "common/parallel/in_parallel.h"
#include "tools/make_terrain/noise.h"
#include "tools/make_terrain/relief.h"

namespace telesplat::terrain {
namespace {

using Rgb = glm::dvec3;

Rgb mix(const Rgb& a, const Rgb& b, double t) { return a + (b - a) * t; }

// Columns, full rows of cells, and the triangles of the last, shorter row.
struct Grid {
  uint64_t columns, rows, rest;
  explicit Grid(uint64_t triangles)
      : columns(std::max<uint64_t>(static_cast<uint64_t>(std::sqrt(static_cast<double>(triangles) / 2)), 1)),
        rows(triangles / (2 * columns)),
        rest(triangles - rows * 2 * columns) {}
  uint64_t vertex_rows() const { return rows + 1; }
  uint64_t rest_vertices() const { return rest == 0 ? 0 : rest / 2 + 1; }
  uint64_t vertices() const { return vertex_rows() * (columns + 1) + rest_vertices(); }
  double step_m() const { return kExtentM / static_cast<double>(std::max(columns, rows)); }
};

// A place on the land: its heights and its colour.
class Land {
 public:
  Land(uint64_t seed, double step_m, const std::function<void(double)>& progress)
      : seed_(seed), relief_(make_relief(seed, progress)), detail_(seed + 10), tint_(seed + 11) {
    // Finer forms than the relief's cells, down to what the grid can show.
    for (double size = 90; size > 2 * step_m && octaves_ < 7; size /= 2) ++octaves_;
  }

  struct Point {
    double height_m;  // height of the surface: ground or water
    double ground_m;
    bool water;
  };
  Point at(double x, double y) const {
    double ground = relief_.sample(x, y);
    if (octaves_ > 0) {
      const double slope = slope_of(relief_, x, y, 40);
      ground += (1.5 + 22 * smooth(0.05, 0.8, slope)) * (detail_.ridged(x / 90, y / 90, octaves_) - 0.55);
    }
    const bool water = ground < kLakeLevelM && caldera_radius(x, y, seed_) < 1.02;
    return {water ? kLakeLevelM : ground, ground, water};
  }

  // slope: rise over run of the surface here.
  Rgb colour(double x, double y, const Point& point, double slope) const {
    const double patchy = tint_.fractal(x / 420, y / 420, 5), fine = tint_.fractal(x / 60 + 9, y / 60 + 9, 3);
    if (point.water) {
      const double depth = kLakeLevelM - point.ground_m;
      const Rgb deep = mix({20, 62, 128}, {10, 36, 94}, smooth(60, 380, depth));
      return mix({78, 152, 168}, deep, smooth(0, 55, depth)) * (1 + 0.02 * patchy);
    }
    const double z = point.height_m, hollow = smooth(-25, 25, mean_around(x, y) - z);
    const Rgb rock =
        mix(mix({118, 108, 98}, {150, 128, 104}, smooth(-0.5, 0.5, patchy)), {92, 84, 80}, smooth(0.0, 0.6, fine));
    const Rgb pumice = mix({176, 158, 126}, {150, 140, 112}, smooth(-0.4, 0.4, fine));
    const Rgb meadow = mix({112, 132, 62}, {140, 142, 82}, smooth(-0.4, 0.5, patchy + 0.4 * fine));
    const Rgb forest = mix({48, 80, 46}, {82, 108, 58}, smooth(-0.5, 0.5, fine + 0.3 * patchy));
    const Rgb snow = {238, 242, 247};
    // From the valleys upwards: meadows, forest, the timber line, bare pumice; rock where it is steep; snow on what is
    // high and not steep.
    Rgb c = mix(meadow, forest,
                smooth(-0.25, 0.15, patchy + 0.35 * fine + 0.5 * smooth(1050, 1500, z) - 0.1 + 0.2 * hollow));
    c = mix(c, pumice, smooth(-60, 60, z - 2120 - 130 * patchy - 60 * hollow));
    c = mix(c, rock, smooth(0.52, 0.8, slope + 0.12 * fine));
    if (const double shore = z - kLakeLevelM; shore < 12 && caldera_radius(x, y, seed_) < 1.02)
      c = mix({188, 174, 146}, c, smooth(0, 12, shore));
    const double cover = z - 2270 - 170 * patchy - 60 * fine + 150 * hollow - 300 * smooth(0.45, 0.9, slope);
    return mix(c, snow, smooth(-60, 60, cover));
  }

 private:
  static double slope_of(const HeightMap& map, double x, double y, double reach) {
    return std::hypot(map.sample(x + reach, y) - map.sample(x - reach, y),
                      map.sample(x, y + reach) - map.sample(x, y - reach)) /
           (2 * reach);
  }
  double mean_around(double x, double y) const {
    constexpr double kReach = 110;
    return 0.25 * (relief_.sample(x + kReach, y) + relief_.sample(x - kReach, y) + relief_.sample(x, y + kReach) +
                   relief_.sample(x, y - kReach));
  }

  uint64_t seed_;
  HeightMap relief_;
  Noise detail_, tint_;
  int octaves_ = 0;
};

void add_triangles(const Grid& grid, std::vector<uint32_t>& indices) {
  const uint64_t triangles = grid.rows * 2 * grid.columns + grid.rest, stride = grid.columns + 1;
  indices.resize(3 * triangles);
  in_parallel(uint64_t{0}, triangles, [&](uint64_t t) {
    const uint64_t cell = t / 2, a = cell / grid.columns * stride + cell % grid.columns;
    const uint64_t corner[2][3] = {{a, a + 1, a + stride}, {a + 1, a + stride + 1, a + stride}};
    for (int k = 0; k < 3; ++k) indices[3 * t + k] = static_cast<uint32_t>(corner[t % 2][k]);
  });
}

}  // namespace

Terrain make_terrain(uint64_t triangles, uint64_t seed, const std::function<void(double)>& user_progress) {
  CHECK(triangles >= kMinTriangles && triangles <= kMaxTriangles);
  const auto progress = [&](double fraction) {
    if (user_progress) user_progress(fraction);
  };
  const Grid grid(triangles);
  const double step = grid.step_m();
  const Land land(seed, step, [&](double f) { progress(0.3 * f); });
  Terrain out;
  out.positions.resize(grid.vertices());
  out.colours.resize(grid.vertices());
  const uint64_t stride = grid.columns + 1, vertices = grid.vertices(), rows = (vertices + stride - 1) / stride;
  std::vector<float> ground_m(vertices);
  std::vector<uint8_t> water(vertices);

  // Calls body(vertex, x, y) for all vertices, a batch of rows at a time; reports progress between `from` and `to`.
  const auto sweep = [&](double from, double to, const auto& body) {
    const uint64_t batch = std::max<uint64_t>(rows / 50, 16);
    for (uint64_t first = 0; first < rows; first += batch) {
      progress(from + (to - from) * static_cast<double>(first) / static_cast<double>(rows));
      in_parallel(first, std::min(first + batch, rows), [&](uint64_t row) {
        for (uint64_t v = row * stride; v < std::min((row + 1) * stride, vertices); ++v)
          body(v, static_cast<double>(v % stride) * step, static_cast<double>(row) * step);
      });
    }
  };
  sweep(0.3, 0.7, [&](uint64_t v, double x, double y) {
    const Land::Point p = land.at(x, y);
    out.positions[v] = {x, y, p.height_m};
    ground_m[v] = static_cast<float>(p.ground_m);
    water[v] = p.water;
  });
  sweep(0.7, 1.0, [&](uint64_t v, double x, double y) {
    const double z = out.positions[v].z;
    const auto rise = [&](bool ahead, uint64_t next, uint64_t before) {
      return (out.positions[ahead ? next : before].z - z) / step;
    };
    const bool last_column = v % stride == grid.columns;
    const double dx = rise(!last_column && v + 1 < vertices, v + 1, v % stride > 0 ? v - 1 : v),
                 dy = rise(v + stride < vertices, v + stride, v - stride);
    const Rgb c = glm::clamp(
        land.colour(x, y, {z, ground_m[v], water[v] != 0}, water[v] ? 0 : std::hypot(dx, dy)) + 0.5, 0.0, 255.0);
    out.colours[v] = static_cast<uint32_t>(c.r) << 16 | static_cast<uint32_t>(c.g) << 8 | static_cast<uint32_t>(c.b);
  });
  add_triangles(grid, out.indices);
  progress(1.0);
  return out;
}

}  // namespace telesplat::terrain
