#include "tools/make_terrain/terrain.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include "common/parallel/in_parallel.h"
#include "tools/make_terrain/noise.h"
#include "tools/make_terrain/relief.h"

namespace telesplat::terrain {
namespace {

using Rgb = glm::dvec3;

Rgb mix(const Rgb& a, const Rgb& b, double t) { return a + (b - a) * t; }

}  // namespace

// A place on the land: its heights and its colour.
class Land {
 public:
  Land(uint64_t seed, double step_m, const Progress& progress)
      : seed_(seed), relief_(make_relief(seed, [&](double f) { progress(f); })), detail_(seed + 10), tint_(seed + 11) {
    // Finer forms than the relief's cells, down to what the grid can show.
    for (double size = 90; size > 2 * step_m && octaves_ < 7; size /= 2) ++octaves_;
  }

  struct Point {
    float height_m;  // height of the surface: ground or water
    float ground_m;
    bool water;
  };
  Point at(double x, double y) const {
    double ground = relief_.sample(x, y);
    if (octaves_ > 0) {
      const double slope = slope_of(relief_, x, y, 40);
      ground += (1.5 + 22 * smooth(0.05, 0.8, slope)) * (detail_.ridged(x / 90, y / 90, octaves_) - 0.55);
    }
    const bool water = ground < kLakeLevelM && caldera_radius(x, y, seed_) < 1.02;
    return {static_cast<float>(water ? kLakeLevelM : ground), static_cast<float>(ground), water};
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

Grid::Grid(uint64_t triangles)
    : triangles(triangles),
      columns(std::max<uint64_t>(static_cast<uint64_t>(std::sqrt(static_cast<double>(triangles) / 2)), 1)),
      rows(triangles / (2 * columns)),
      rest(triangles - rows * 2 * columns) {
  CHECK(triangles >= kMinTriangles && triangles <= kMaxTriangles);
}

Terrain::Terrain(uint64_t triangles, uint64_t seed, const Progress& progress)
    : grid_(triangles),
      step_m_(kExtentM / static_cast<double>(std::max(grid_.columns, grid_.rows))),
      land_(std::make_shared<Land>(seed, step_m_, progress)) {}

std::vector<Vertex> Terrain::vertices(uint64_t first_row, uint64_t last_row) const {
  const uint64_t stride = grid_.columns + 1, count = grid_.vertices();
  const uint64_t first = std::min(first_row * stride, count), last = std::min(last_row * stride, count);
  const auto x_m = [&](uint64_t v) { return static_cast<double>(v % stride) * step_m_; };
  const auto y_m = [&](uint64_t v) { return static_cast<double>(v / stride) * step_m_; };
  // Slopes need the heights of one row more at either side.
  const uint64_t begin = first - std::min(first, stride), end = std::min(last + stride, count);
  std::vector<Land::Point> points(end - begin);
  in_parallel(begin, end, [&](uint64_t v) { points[v - begin] = land_->at(x_m(v), y_m(v)); });
  std::vector<Vertex> out(last - first);
  in_parallel(first, last, [&](uint64_t v) {
    const Land::Point& point = points[v - begin];
    const auto rise = [&](bool ahead, uint64_t next, uint64_t before) {
      return (static_cast<double>(points[(ahead ? next : before) - begin].height_m) - point.height_m) / step_m_;
    };
    const bool last_column = v % stride == grid_.columns;
    const double dx = rise(!last_column && v + 1 < count, v + 1, v % stride > 0 ? v - 1 : v),
                 dy = rise(v + stride < count, v + stride, v - stride);
    const Rgb c =
        glm::clamp(land_->colour(x_m(v), y_m(v), point, point.water ? 0 : std::hypot(dx, dy)) + 0.5, 0.0, 255.0);
    out[v - first] = {{static_cast<float>(x_m(v)), static_cast<float>(y_m(v)), point.height_m},
                      {static_cast<uint8_t>(c.r), static_cast<uint8_t>(c.g), static_cast<uint8_t>(c.b)}};
  });
  return out;
}

std::vector<Face> Terrain::faces(uint64_t first_row, uint64_t last_row) const {
  const auto begin_of = [&](uint64_t row) { return std::min(row * 2 * grid_.columns, grid_.triangles); };
  const uint64_t stride = grid_.columns + 1, first = begin_of(first_row), last = begin_of(last_row);
  std::vector<Face> out(last - first);
  in_parallel(first, last, [&](uint64_t t) {
    const uint64_t cell = t / 2;
    const auto a = static_cast<uint32_t>(cell / grid_.columns * stride + cell % grid_.columns);
    const auto c = static_cast<uint32_t>(a + stride);
    out[t - first] = t % 2 == 0 ? Face{3, {a, a + 1, c}} : Face{3, {a + 1, c + 1, c}};
  });
  return out;
}

}  // namespace telesplat::terrain
