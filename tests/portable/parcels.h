// The file from make_parcels to digest_parcels: streams of the codec, each with a digest of its source.
//   file = (u8 kind, u32 bytes, the bytes, u64 digest)*, little-endian
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "common/codec/sparse/scatter.h"

namespace telesplat::portable {

enum class Kind : uint8_t {
  kGolomb = 1,  ///< u32 count, u32 expected; bits of GolombContext
  kScatter =
      3,  ///< u32 width, height, count; u16 x, y of each pixel; residuals of ScatterPredictor, by one GolombContext
  kDepth = 4,      ///< a stream of codec::encode
  kRefinement = 5  ///< u32 bytes of a stream of codec::encode, the stream; one of codec::encode_refinement
};

/// FNV-1a, 64 bit, of 32-bit numbers.
class Digest {
 public:
  void add(uint32_t value) {
    for (int i = 0; i < 4; ++i) hash_ = (hash_ ^ (value >> 8 * i & 255)) * 0x100000001b3u;
  }
  uint64_t value() const { return hash_; }

 private:
  uint64_t hash_ = 0xcbf29ce484222325u;
};

template <class T>
void put(std::vector<uint8_t>& out, T value) {
  const size_t at = out.size();
  out.resize(at + sizeof(T));
  std::memcpy(out.data() + at, &value, sizeof(T));
}

/// Precondition: sizeof(T) bytes are left.
template <class T>
T take(const uint8_t*& at) {
  T out;
  std::memcpy(&out, at, sizeof(T));
  at += sizeof(T);
  return out;
}

constexpr int kParts = 6;  ///< numbers of a pixel: depth, two of the normal, blue, green, red

inline void parts_of(const codec::detail::Pixel& p, int* out) {
  out[0] = static_cast<int>(p.depth);
  out[1] = p.normal & 255, out[2] = p.normal >> 8;
  out[3] = static_cast<int>(p.colour & 255), out[4] = static_cast<int>(p.colour >> 8 & 255);
  out[5] = static_cast<int>(p.colour >> 16 & 255);
}

inline void parts_of(const codec::detail::Guess& guess, int* out) {
  const auto whole = [](int sixteenths) { return (sixteenths + 8) >> 4; };
  out[0] = whole(guess.depth), out[1] = whole(guess.normal[0]) & 255, out[2] = whole(guess.normal[1]) & 255;
  for (int c = 0; c < 3; ++c) out[3 + c] = static_cast<int>(guess.colour >> 8 * c & 255);
}

inline codec::detail::Pixel pixel_of(const int* parts) {
  const auto byte = [&](int i) { return static_cast<uint32_t>(parts[i]) & 255; };
  return {static_cast<uint32_t>(parts[0]), byte(3) | byte(4) << 8 | byte(5) << 16,
          static_cast<uint16_t>(byte(1) | byte(2) << 8)};
}

}  // namespace telesplat::portable
