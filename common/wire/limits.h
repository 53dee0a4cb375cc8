// The protocol's version, and the sizes and counts that every message keeps to. Decoding refuses anything beyond them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace telesplat::wire {

inline constexpr uint64_t kProtocolVersion = 21;

inline constexpr size_t kMaxString = 4096;            ///< bytes of any string
inline constexpr size_t kMaxFact = 64u << 10;         ///< bytes of a text in facts and arguments: transfer functions
inline constexpr size_t kMaxControlBytes = 1u << 20;  ///< whole body of a message without bulk fields
inline constexpr size_t kMaxBulkBytes = 256u << 20;   ///< all bulk fields of a message
inline constexpr size_t kMaxKeys = 1u << 21;          ///< cluster keys in one message
inline constexpr size_t kMaxEntries = 4096;           ///< entries of a map or list
inline constexpr size_t kMaxElements = 1u << 16;      ///< elements of all lists and maps of a message together
inline constexpr uint64_t kMaxTiles = 1u << 16;       ///< tiles of a frame, and blocks
inline constexpr size_t kMaxMaskWords = 1u << 17;     ///< words of a tile's mask: 512 KiB
inline constexpr size_t kPlanNumbers = 6;             ///< numbers that a plan holds for each tile
inline constexpr size_t kMaxPlanWords = 1u << 21;     ///< words of all masks of a plan: 8 MiB
inline constexpr uint64_t kMaxStep = 16;              ///< step of a coarse frame: it has every step-th pixel
inline constexpr int kMaxTileSide = 2048;             ///< side of the squares that a frame is cut into
inline constexpr int64_t kMaxTilePixels = 1 << 22;    ///< pixels of a tile: a few bytes may claim that it has more
inline constexpr uint64_t kMaxSlabs = 1024;           ///< slabs of a volume, and samplers that share it
inline constexpr uint64_t kMaxBuffers = 8;            ///< buffers of a loosely coupled viewer
inline constexpr size_t kSealWords = 4;               ///< words of a lease's seal: 16 bytes
inline constexpr size_t kLeaseKeyWords = 8;           ///< words of the key that seals leases: 32 bytes
inline constexpr uint64_t kMaxBaseParts = 1u << 21;   ///< parts of a base
inline constexpr uint64_t kMaxBaseTriangles = 1u << 22;  ///< triangles of a base that a viewer asks for
inline constexpr uint64_t kBasePart = 4096;           ///< triangles of a part of a base, at most
inline constexpr size_t kMaxViews = 64;               ///< viewers that one sampling frame of a volume serves

/// A bulk field. When encoding it points to the sender's bytes; when decoded it points into the received frame.
using Bytes = std::span<const std::byte>;

/// True if a message may be larger than kMaxControlBytes. It declares it: `static constexpr bool kBulk = true;`.
template <class M>
inline constexpr bool kIsBulk = requires {
  requires M::kBulk;
};

/// Most bytes of a message's body.
template <class M>
inline constexpr size_t kBodyLimit = kIsBulk<M> ? kMaxBulkBytes + kMaxControlBytes : kMaxControlBytes;

/// Most elements of all lists and maps in a message, a map's keys included. A message that may have more declares how
/// many more: `static constexpr size_t kElements = ...;`.
template <class M>
consteval size_t element_limit() {
  if constexpr (requires { M::kElements; })
    return kMaxElements + M::kElements;
  else
    return kMaxElements;
}

}  // namespace telesplat::wire
