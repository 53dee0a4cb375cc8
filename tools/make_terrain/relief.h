// The large forms of the land: a caldera with a lake, shaped by running water, at a fixed resolution.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace telesplat::terrain {

inline constexpr double kExtentM = 14000;  ///< side of the square
inline constexpr double kLakeLevelM = 1883;

/// Heights on a square grid: row-major, from (0, 0) to (kExtentM, kExtentM), both ends included.
struct HeightMap {
  int side = 0;
  std::vector<float> height_m;
  double cell_m() const { return kExtentM / (side - 1); }
  float& at(int x, int y) { return height_m[static_cast<size_t>(y) * side + x]; }
  float at(int x, int y) const { return height_m[static_cast<size_t>(y) * side + x]; }
  /// Catmull-Rom interpolation (C1, passes through the grid's values); positions outside are clamped.
  double sample(double x_m, double y_m) const;
};

/// Returns the distance of a point from the caldera's centre over that of the rim's crest in the same direction. Below
/// 1: inside.
double caldera_radius(double x_m, double y_m, uint64_t seed);

/// Builds a volcano with a collapsed summit, an island in it, side cones, and valleys cut by erosion. The same seed
/// makes the same land.
HeightMap make_relief(uint64_t seed, const std::function<void(double fraction)>& progress);

}  // namespace telesplat::terrain
