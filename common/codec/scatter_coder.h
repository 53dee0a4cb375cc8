// The residuals of scattered pixels <-> bits. How large a residual is expected to be depends on how large those of its
// neighbours were.
//   scatter = block of flags, one bit a pixel: its colour is as predicted; stored block of bits. These are of each
//   pixel depth, the normal's bytes, and unless its flag is set green, blue - green, red - green.
// Within bounds (lattice.h) residuals are steps from where the prediction lies, and a colour is as predicted if it is
// near enough. Normals are turned by a pole of the tile's, which scatter begins with.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/codec/golomb.h"
#include "common/codec/lattice.h"
#include "common/codec/scatter.h"

namespace telesplat::codec::detail {

/// Contexts of one tile.
struct ScatterContexts {
  static constexpr int kDepthBits = 24, kByteBits = 8;  // the most that a residual takes
  void start();
  GolombContext depth[kDepthBits + 1];        // [expected]
  GolombContext normal[2][kByteBits + 1][5];  // [component][expected][of the other component]
  GolombContext colour[3][kByteBits + 1];     // [channel][expected; of the channel before]
};

class ScatterEncoder {
 public:
  /// `count` pixels follow. `bounds` must outlive them.
  void start(size_t count, const TileBounds& bounds);
  /// `pixel` becomes what is decoded.
  Magnitudes put(Pixel& pixel, const Guess& guess);
  void finish(std::vector<uint8_t>& out);

 private:
  ScatterContexts contexts_;
  const TileBounds* bounds_ = nullptr;
  std::vector<uint8_t> plain_;
  BitWriter bits_;
  size_t done_ = 0;
};

class ScatterDecoder {
 public:
  /// Reads what `count` pixels are made of; false where it is damaged.
  [[nodiscard]] bool start(Reader& in, size_t count, const TileBounds& bounds);
  /// Nothing where the stream is damaged.
  std::optional<Pixel> get(const Guess& guess, Magnitudes& magnitudes);
  /// All bits were taken.
  [[nodiscard]] bool finished() const { return bits_.finished(); }

 private:
  ScatterContexts contexts_;
  const TileBounds* bounds_ = nullptr;
  std::vector<uint8_t> plain_;
  BitReader bits_;
  size_t done_ = 0;
};

}  // namespace telesplat::codec::detail
