// Tracing a part of an image: from rays to surface points with normals and colours. Two implementations with equal
// results: a SIMD kernel, chosen for the processor at run time, and its scalar oracle, in which the algorithm is meant
// to be read.
//
//   cones    for each block of 8 x 8 pixels the depth up to which none of its rays meets the surface, or that none does
//   clipping of every ray to the box, to the ball that holds the set, and to what its block's cone left
//   marching until the estimate is below the threshold lod * footprint(t): a bracket of the surface's depth
//   surface  the depth refined within its bracket; normal, colour, occlusion, shadow
#pragma once

#include <cstdint>

#include "services/sampler/julia/scene.h"

namespace telesplat::sampler {

/// Pixels [x_begin, x_end) x [y_begin, y_end) of a row of blocks, counted from rays.x0, rays.y0.
struct JuliaPart {
  static constexpr int kBlocks = 16;  ///< at most
  int block_row, block_begin, block_end;
  int x_begin, x_end, y_begin, y_end;
};

/// Surface points, in no particular order.
struct JuliaPoints {
  static constexpr int kMost = JuliaPart::kBlocks * kJuliaBlock * kJuliaBlock;
  static constexpr int kPadded = kMost + 64;  ///< kernels write whole vectors
  int count = 0;
  int32_t x[kPadded], y[kPadded];  ///< pixel, from rays.x0, rays.y0
  float depth_m[kPadded];
  float normal[3][kPadded];  ///< room space, unit length, facing the viewer
  float tone[kPadded];       ///< where in the palette; the whole part means nothing
  float light[kPadded];      ///< 0..1, multiplies the colour
};

/// Adds the surface points of a part to `points`, which has room for them.
using JuliaTrace = void (*)(const JuliaScene::Constants& scene, const JuliaRays& rays, const JuliaPart& part,
                            JuliaPoints& points);

/// For a ray that meets the surface where it begins, at depth t: the normal of the face through which it enters the box
/// there; false where it enters none, which is where the camera is inside the set. direction: room space.
bool face_normal(const JuliaScene::Constants& scene, const JuliaRays& rays, const float* direction, float t,
                 float* normal);

/// SIMD.
void julia_trace(const JuliaScene::Constants& scene, const JuliaRays& rays, const JuliaPart& part, JuliaPoints& points);
/// The oracle.
void julia_trace_plainly(const JuliaScene::Constants& scene, const JuliaRays& rays, const JuliaPart& part,
                         JuliaPoints& points);

}  // namespace telesplat::sampler
