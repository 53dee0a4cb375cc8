// Traces a part of an image: from rays to surface points with normals and colours, by a SIMD kernel that is chosen for
// the processor at run time. Its scalar oracle, with equal results, is meant to be read: tests/support/julia/plain.h.
//
//   cones    for each block of 8 x 8 pixels the depth up to which no ray of it meets the surface, or that no ray does
//   clipping of every ray to the box, to the ball that holds the set, and to the depths behind its block's cone
//   marching until the estimate is below the threshold lod * footprint(t): a bracket of the surface's depth
//   surface  the depth refined within its bracket; normal, colour, occlusion, shadow
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>

#include "services/sampler/julia/scene.h"

namespace telesplat::sampler {

/// Some of the pixels of a row of blocks, counted from rays.x0, rays.y0.
struct JuliaPart {
  static constexpr int kBlocks = 16;   ///< blocks, at most
  static constexpr int kPadding = 16;  ///< blocks: kernels read whole vectors
  int block_row, block_begin, block_end;
  /// The pixels to be traced: bit i of wanted[y][b] is pixel i of row y of block block_begin + b.
  uint8_t wanted[kJuliaBlock][kBlocks + kPadding] = {};

  bool any(int block) const {
    return std::any_of(wanted, wanted + kJuliaBlock, [&](const auto& row) { return row[block - block_begin] != 0; });
  }
  int rays() const {
    int n = 0;
    for (const auto& row : wanted)
      for (const uint8_t bits : row) n += std::popcount(bits);
    return n;
  }
};

/// Surface points, in no particular order.
struct JuliaPoints {
  static constexpr int kMost = JuliaPart::kBlocks * kJuliaBlock * kJuliaBlock;
  static constexpr int kPadded = kMost + 64;  ///< kernels write whole vectors
  int count = 0;
  int32_t x[kPadded], y[kPadded];  ///< pixel, from rays.x0, rays.y0
  float depth_m[kPadded];
  float normal[3][kPadded];  ///< room space, unit length, facing the viewer
  float tone[kPadded];       ///< place in the palette; the whole part is ignored
  float light[kPadded];      ///< 0..1, multiplies the colour
};

/// Adds the surface points of the parts, of at most JuliaPoints::kMost rays in all, to `points`, which has room for
/// them.
using JuliaTrace = void (*)(const JuliaScene::Constants& scene, const JuliaRays& rays, std::span<const JuliaPart> parts,
                            JuliaPoints& points);

/// For a ray that meets the surface where it begins, at depth t: writes the normal of the face through which it enters
/// the box there. False: it enters through no face, as the camera is inside the set. direction: room space.
bool face_normal(const JuliaScene::Constants& scene, const JuliaRays& rays, const float* direction, float t,
                 float* normal);

void julia_trace(const JuliaScene::Constants& scene, const JuliaRays& rays, std::span<const JuliaPart> parts,
                 JuliaPoints& points);

}  // namespace telesplat::sampler
