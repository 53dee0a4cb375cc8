// Marching cubes' cases: the triangles in a cube whose corners lie inside or outside.
#pragma once

#include <array>
#include <cstdint>

namespace telesplat::data {

/// Corner c of a cube stands at (c & 1, c >> 1 & 1, c >> 2). Edges 0..3 run along x from corners 0 2 4 6, 4..7 along y
/// from 0 1 4 5, 8..11 along z from 0 1 2 3.
struct CubeCase {
  int triangles = 0;
  std::array<std::array<uint8_t, 3>, 12> edges{};  ///< of each triangle; their normal looks away from inside corners
};

/// By the bits of corners that are inside. Faces with two inside corners at a diagonal keep these apart, in either of
/// the cubes that share it, so that surfaces are closed.
const std::array<CubeCase, 256>& cube_cases();

}  // namespace telesplat::data
