// Non-transparent voxels, sparse: data servers send and samplers hold them. A *row* is all voxels of one (j, k); a
// *slice* all rows of one k.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/result.h"
#include "common/volume/levels.h"

namespace telesplat::volume {

/// Some voxels of the slices [k_begin, k_end), in order of (k, j, i).
struct Voxels {
  int k_begin = 0, k_end = 0;
  /// Row (j, k) has the voxels [rows[r], rows[r + 1]) with r = (k - k_begin) * size_y + j; (k_end - k_begin) * size_y +
  /// 1 entries.
  std::vector<uint32_t> rows;
  std::vector<uint16_t> i;      ///< ascending in a row
  std::vector<uint16_t> level;  ///< < Levels::count
  std::vector<uint16_t>
      normal;  ///< image::encode_normal16 of the outward gradient, room space; kNoNormal; empty: not lit
  size_t size() const { return i.size(); }
  bool operator==(const Voxels&) const = default;
};

/// Normal of a voxel without a usable gradient. encode_normal16 never gives it.
inline constexpr uint16_t kNoNormal = 0xffff;

/// A set of levels: bit l of byte l / 8. For levels that a sampler holds already, or that a transfer function shows.
class LevelSet {
 public:
  LevelSet() : bits_(kMaxLevels / 8) {}
  bool has(int level) const { return bits_[size_t(level) / 8] >> (level % 8) & 1; }
  void add(int level) { bits_[size_t(level) / 8] |= uint8_t(1u << (level % 8)); }
  void add(const LevelSet& others);
  bool empty() const;
  bool contains(const LevelSet& others) const;
  std::span<const uint8_t> bytes() const { return bits_; }
  /// Error: not kMaxLevels / 8 bytes.
  static Result<LevelSet> from_bytes(std::span<const uint8_t> bytes);
  bool operator==(const LevelSet&) const = default;

 private:
  std::vector<uint8_t> bits_;
};

inline constexpr size_t kMaxVoxelsCoded = size_t{1} << 25;  ///< in one coded set; a slice has at most half of that

/// Writes a compact form, about two to four bytes a voxel: occupancy as runs, levels and normals as differences from
/// their neighbours', in byte planes, entropy-coded. Precondition: at most kMaxVoxelsCoded voxels, with rows and order
/// as in Voxels.
std::vector<uint8_t> encode_voxels(const Voxels& voxels, int size_x, int size_y);
/// Reads the compact form; bytes come from outside. k_begin, k_end: the requested slices; the answer may have fewer.
/// Error: truncated, more than kMaxVoxelsCoded, slices, places or levels beyond the request or the grid. Memory grows
/// with the requested rows and with the voxels in the bytes.
Result<Voxels> decode_voxels(std::span<const uint8_t> bytes, int size_x, int size_y, int k_begin, int k_end,
                             int level_count);

/// The union of two disjoint sets of the same slices (a sampler's own voxels, and those that a new transfer function
/// adds). Both lit, or neither; a set without voxels counts as either.
Voxels merge(const Voxels& a, const Voxels& b);

}  // namespace telesplat::volume
