#include "services/data/surface/cube_cases.h"

#include <algorithm>
#include <utility>

namespace telesplat::data {
namespace {

// Corners of each face, counterclockwise as seen from outside.
constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

int edge_between(int a, int b) {
  const int low = std::min(a, b), axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
  return axis == 0 ? low >> 1 : axis == 1 ? 4 + ((low & 1) | (low >> 2) << 1) : 8 + low;
}

// Within each face lines go from where its outline leaves the inside to where it came in; they join to loops through
// the cube's faces, which become fans.
CubeCase make_case(int inside) {
  std::array<int, 12> next;
  next.fill(-1);
  for (const auto& face : kFaces)
    for (int i = 0; i < 4; ++i) {
      const auto is_inside = [&](int k) { return (inside >> face[k & 3] & 1) != 0; };
      if (!is_inside(i) || is_inside(i + 1)) continue;
      int back = i;  // to the corner where this run of inside corners begins
      while (is_inside(back + 3)) back += 3;
      next[size_t(edge_between(face[back & 3], face[(back + 3) & 3]))] = edge_between(face[i], face[(i + 1) & 3]);
    }
  CubeCase out;
  for (int start = 0; start < 12; ++start) {
    std::array<uint8_t, 12> loop;
    size_t length = 0;
    for (int edge = start; next[size_t(edge)] >= 0;) {
      loop[length++] = uint8_t(edge);
      edge = std::exchange(next[size_t(edge)], -1);
    }
    for (size_t i = 2; i < length; ++i) out.edges[size_t(out.triangles++)] = {loop[0], loop[i - 1], loop[i]};
  }
  return out;
}

}  // namespace

const std::array<CubeCase, 256>& cube_cases() {
  static const auto cases = [] {
    std::array<CubeCase, 256> out;
    for (int inside = 0; inside < 256; ++inside) out[size_t(inside)] = make_case(inside);
    return out;
  }();
  return cases;
}

}  // namespace telesplat::data
