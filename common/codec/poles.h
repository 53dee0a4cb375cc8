// Octahedral codes of normals, with an axis of the lattice chosen as pole so that the map's seam is far away.
#pragma once

#include <cstdint>
#include <cstdlib>

namespace telesplat::codec::detail {

/// Poles 0 to 5 turn the lattice: the axis pole / 2 becomes z, negated if the pole is odd. kRaw leaves codes unchanged.
inline constexpr int kPoles = 6, kRaw = 6;

/// A point of the octahedron's lattice: |x| + |y| + |z| = 127.
struct LatticePoint {
  int x, y, z;
};

constexpr LatticePoint lattice_point(uint16_t code) {
  const int cx = code & 255, cy = code >> 8;
  const int x = (cx < 254 ? cx : 254) - 127, y = (cy < 254 ? cy : 254) - 127;
  const int z = 127 - (x < 0 ? -x : x) - (y < 0 ? -y : y), fold = z < 0 ? -z : 0;
  return {x + (x >= 0 ? -fold : fold), y + (y >= 0 ? -fold : fold), z};
}

/// The point's canonical code.
constexpr uint16_t code_of(const LatticePoint& p) {
  const int x = 127 - (p.y < 0 ? -p.y : p.y), y = 127 - (p.x < 0 ? -p.x : p.x);
  const int cx = p.z < 0 ? (p.x >= 0 ? x : -x) : p.x, cy = p.z < 0 ? (p.y >= 0 ? y : -y) : p.y;
  return static_cast<uint16_t>((cx + 127) | (cy + 127) << 8);
}

/// A permutation of the canonical codes; other codes of a direction are treated as its canonical one. Poles are 2 *
/// axis + (negated ? 1 : 0).
constexpr uint16_t turn_normal(uint16_t code, int axis, bool negated) {
  if (axis == kRaw / 2) return code;
  const LatticePoint p = lattice_point(code);
  const int x = axis == 0   ? p.y
                : axis == 1 ? p.z
                            : p.x,
            y = axis == 0   ? p.z
                : axis == 1 ? p.x
                            : p.y,
            z = axis == 0   ? p.x
                : axis == 1 ? p.y
                            : p.z;
  return code_of({x, y, negated ? -z : z});
}
constexpr uint16_t turn_back(uint16_t code, int axis, bool negated) {
  if (axis == kRaw / 2) return code;
  const LatticePoint p = lattice_point(code);
  const int z = negated ? -p.z : p.z;
  return code_of({axis == 0   ? z
                  : axis == 1 ? p.y
                              : p.x,
                  axis == 0   ? p.x
                  : axis == 1 ? z
                              : p.y,
                  axis == 0   ? p.y
                  : axis == 1 ? p.x
                              : z});
}
constexpr uint16_t turn_normal(uint16_t code, int pole) { return turn_normal(code, pole / 2, pole % 2 != 0); }
constexpr uint16_t turn_back(uint16_t code, int pole) { return turn_back(code, pole / 2, pole % 2 != 0); }

/// Finds the pole nearest to most normals.
class PoleChoice {
 public:
  void add(uint16_t code) {
    const LatticePoint p = lattice_point(code);
    sum_[0] += p.x, sum_[1] += p.y, sum_[2] += p.z;
  }
  int best() const {
    int axis = 2;
    for (int a = 0; a < 2; ++a)
      if (std::abs(sum_[a]) > std::abs(sum_[axis])) axis = a;
    return 2 * axis + (sum_[axis] < 0 ? 1 : 0);
  }

 private:
  int64_t sum_[3] = {};
};

}  // namespace telesplat::codec::detail
