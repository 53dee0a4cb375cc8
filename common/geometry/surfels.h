// Surfel sets: the coarse form of a surface, one block of bytes that a data server makes and a packer reads.
// Little-endian, room space. N surfels:
//
//   offset     type            what
//   0          SurfelHeader    32 bytes
//   32         float[3][N]     mean positions, metres
//   32 + 12 N  uint32[N]       mean normals, octahedral, 2 x 16 bits (image/normal.h: encode_normal32)
//   32 + 16 N  uint32[N]       mean colours, 0x00RRGGBB, unlit albedo; or, with SurfelHeader::scalars, float[N] scalars
//                              (NaN: none) that a colouring turns into colours
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/result.h"

namespace telesplat::geometry {

inline constexpr uint32_t kSurfelMagic = 0x46535354;  // "TSSF"
inline constexpr uint32_t kMaxSurfels = 1u << 22;

struct SurfelHeader {
  uint32_t magic = kSurfelMagic;
  uint32_t surfels = 0;
  uint32_t scalars = 0;  ///< 1: the colours are scalars, 0: colours
  float spacing_m = 0;   ///< side of the cells that surfels are means of
  uint32_t reserved[4] = {};
};
static_assert(sizeof(SurfelHeader) == 32);

/// A validated set: spans into bytes (4-byte aligned) that must outlive it.
struct SurfelView {
  float spacing_m = 0;
  bool scalars = false;
  std::span<const float> positions_room;  ///< 3 N
  std::span<const uint32_t> normals;      ///< N
  std::span<const uint32_t> colours;      ///< N; scalars: the bits of floats
  size_t size() const { return normals.size(); }

  /// Checks magic, counts against the limit and against bytes.size(), the spacing, and that positions are finite.
  /// Allocates nothing. Precondition: bytes.data() is 4-byte aligned; the content may be anything.
  static Result<SurfelView> validate(std::span<const std::byte> bytes);
};

/// Lays out one set. Precondition: N entries each (positions: 3 N), 1 to kMaxSurfels; spacing_m > 0.
std::vector<std::byte> build_surfels(std::span<const float> positions_room, std::span<const uint32_t> normals,
                                     std::span<const uint32_t> colours, float spacing_m, bool scalars);

}  // namespace telesplat::geometry
