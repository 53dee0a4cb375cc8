// Coding of surfels: points with normals and colours in the leaves of an octree, for a viewer's base.
//
// Positions are an octree of eight levels in each leaf: one byte of occupied children a node, coded bit by bit with
// adaptive frequencies (codec/range_coder.h). Normals and colours follow as differences from the point before.
// Based on: D. Meagher, "Geometric modeling using octree encoding", Computer Graphics and Image Processing 19, 1982.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/core/result.h"

namespace telesplat::codec {

/// Leaves of one stream, and surfels of all its leaves, at most.
inline constexpr size_t kMaxSurfelLeaves = 1u << 16, kMaxCodedSurfels = 1u << 20;

/// A surfel in a leaf: coordinates in 256ths of its side, normal (image/normal.h: encode_normal16), colour 0x00RRGGBB.
struct LeafSurfel {
  uint8_t x = 0, y = 0, z = 0;
  uint16_t normal = 0;
  uint32_t colour = 0;
  bool operator==(const LeafSurfel&) const = default;
  /// Place on a Morton curve: 24 bits.
  uint32_t place() const;
};

struct SurfelLeaf {
  uint32_t key = 0;                 ///< 30 bits: points::ClusterKey
  uint32_t first = 0;               ///< 24 bits: a number that goes with the leaf, such as that of its first surfel
  std::vector<LeafSurfel> surfels;  ///< ascending places, each once
  bool operator==(const SurfelLeaf&) const = default;
};

/// Precondition: within the limits, no leaf empty.
std::vector<uint8_t> encode_surfels(std::span<const SurfelLeaf> leaves);
/// Reads what encode_surfels() wrote; other bytes give an error or some leaves within the limits. Allocates no more
/// than the surfels read so far need.
Result<std::vector<SurfelLeaf>> decode_surfels(std::span<const uint8_t> bytes);

}  // namespace telesplat::codec
