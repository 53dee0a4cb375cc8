// The header of a PLY file. Source: G. Turk, "The PLY Polygon File Format", 1994.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::data {

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };
enum class PlyType : uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kInt64, kUint64, kFloat32, kFloat64 };
inline constexpr size_t kPlyTypeBytes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;  ///< of a list: of its items
  bool is_list = false;
  PlyType count_type = PlyType::kUint8;
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;  ///< as claimed
  std::vector<PlyProperty> properties;

  /// The index of a property, or -1.
  int find(std::string_view property) const;
  /// Fewest bytes that one of these takes in a file of this encoding (lists empty).
  size_t least_bytes(PlyEncoding encoding) const;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
  size_t bytes = 0;                   ///< of the header: where the data starts
  std::vector<std::string> textures;  ///< pictures, of comments "TextureFile", in the order of their numbers

  const PlyElement* find(std::string_view element) const;
};

/// Parses the header. Claimed counts are checked against the size of `content`: what is returned can be allocated by.
/// Limits: 64 elements, 256 properties each, 1,024 textures, a header of 1 MiB. Errors start with `name`.
Result<PlyHeader> parse_ply_header(std::string_view content, const std::string& name);

}  // namespace telesplat::data
