// Makes a depth image's colours and normals of ray hits, eight at a time: both are interpolated over the triangle.
//
//   n = (1-u-v) n0 + u n1 + v n2          colour likewise, per channel; for scalars: that of the interpolated one
//   each nk is negated first if it points away from the side of the triangle that the ray sees:
//     sign(nk . g) == sign(d . g); so the winding of a triangle does not matter
//   if n faces away all the same, as over an edge or a coarse mesh, it is turned across the ray, because viewers
//     leave out points that face away: n - kTurn (n . d) d / (d . d)
// with g either normal of the triangle's plane and d the ray's direction.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "common/geometry/mesh_chunk.h"
#include "common/scene/colouring.h"

namespace telesplat::sampler {

inline constexpr int kPacket = 8;
/// Above 1, so that a normal along the ray turns round. raster_shaders.h has it, too.
inline constexpr float kTurn = 1.02f;

/// Up to eight hits. Lanes without a hit may hold any finite values.
struct HitPacket {
  alignas(32) float u[kPacket], v[kPacket];  ///< barycentric weights of corners 1 and 2
  alignas(32) float geometric_normal[3][kPacket], direction[3][kPacket];
  alignas(32) uint32_t corner_normal[3][kPacket];  ///< [corner], image/normal.h: encode_normal32
  alignas(32) uint32_t corner_colour[3][kPacket];  ///< [corner], 0x00RRGGBB; for scalars the bits of floats
};

/// Interpolates the attributes in every lane. SIMD, chosen for the processor at run time. colour: 0x00RRGGBB. normal:
/// image/normal.h: encode_normal16, in 32 bits. Both 32-byte aligned. scalars: their colours, if all corners have
/// scalars; null: corners have colours.
void shade_hits(const HitPacket& hits, uint32_t* colour, uint32_t* normal, const scene::ColourTable* scalars = nullptr);

/// One hit, unquantised: used by direct rendering, and the oracle of shade_hits.
struct SurfacePoint {
  glm::vec3 colour;  ///< 0..255 per channel
  glm::vec3 normal;  ///< unit length, facing the viewer
};
/// uv: barycentric weights of corners 1 and 2.
SurfacePoint surface_point(const geometry::MeshChunkView& chunk, uint32_t triangle, const glm::vec2& uv,
                           const glm::vec3& geometric_normal, const glm::vec3& direction,
                           const scene::ColourTable& colours);

}  // namespace telesplat::sampler
