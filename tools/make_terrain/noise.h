// Seeded gradient noise in two dimensions. Source: K. Perlin, "Improving Noise", SIGGRAPH 2002 (hashed gradients,
// quintic fade).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace telesplat::terrain {

/// Rises from 0 at `from` to 1 at `to`, with no slope at either.
inline double smooth(double from, double to, double v) {
  const double t = std::clamp((v - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

class Noise {
 public:
  explicit Noise(uint64_t seed) : seed_(seed) {}

  /// One octave: about -1..1, zero at whole coordinates, features of size 1.
  double operator()(double x, double y) const {
    const double fx = std::floor(x), fy = std::floor(y), u = x - fx, v = y - fy;
    const auto ix = static_cast<int64_t>(fx), iy = static_cast<int64_t>(fy);
    const double su = fade(u), sv = fade(v);
    const double a = gradient(ix, iy, u, v), b = gradient(ix + 1, iy, u - 1, v), c = gradient(ix, iy + 1, u, v - 1),
                 d = gradient(ix + 1, iy + 1, u - 1, v - 1);
    return 1.5 * (a + su * (b - a) + sv * (c - a + su * (a - b - c + d)));
  }

  /// Returns a sum of octaves, each of half the size and `gain` times the height of the one before. About -1..1.
  double fractal(double x, double y, int octaves, double gain = 0.5) const {
    double sum = 0, amplitude = 1, total = 0;
    for (int i = 0; i < octaves; ++i, amplitude *= gain, x = 2 * x + 17.3, y = 2 * y - 9.1)
      sum += amplitude * (*this)(x, y), total += amplitude;
    return sum / total;
  }

  /// Returns a sum of octaves of ridges: 0 in valleys, 1 on crests.
  double ridged(double x, double y, int octaves) const {
    double sum = 0, amplitude = 1, total = 0;
    for (int i = 0; i < octaves; ++i, amplitude *= 0.5, x = 2 * x + 5.7, y = 2 * y + 3.9) {
      const double ridge = 1 - std::abs((*this)(x, y));
      sum += amplitude * ridge * ridge, total += amplitude;
    }
    return sum / total;
  }

  /// Returns a number in 0..1 for a whole number.
  double uniform(uint64_t n) const { return static_cast<double>(mix(n * 0x9e3779b97f4a7c15 + seed_) >> 11) * 0x1p-53; }

 private:
  static double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
  static uint64_t mix(uint64_t h) {  // splitmix64
    h = (h ^ h >> 30) * 0xbf58476d1ce4e5b9;
    h = (h ^ h >> 27) * 0x94d049bb133111eb;
    return h ^ h >> 31;
  }
  // One of eight directions for each lattice point.
  double gradient(int64_t ix, int64_t iy, double u, double v) const {
    const uint64_t h =
        mix(seed_ + static_cast<uint64_t>(ix) * 0x9e3779b97f4a7c15 + static_cast<uint64_t>(iy) * 0xd1b54a32d192ed03);
    constexpr double kAlongX[8] = {1, -1, 0, 0, 1, 1, -1, -1}, kAlongY[8] = {0, 0, 1, -1, 1, -1, 1, -1};
    const double along = kAlongX[h >> 61] * u + kAlongY[h >> 61] * v;
    return h >> 61 < 4 ? along : 0.70710678118654752 * along;
  }
  uint64_t seed_;
};

}  // namespace telesplat::terrain
