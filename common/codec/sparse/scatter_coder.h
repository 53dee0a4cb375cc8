// The residuals of scattered pixels <-> bits. How large a residual is expected to be depends on how large those of its
// neighbours were, and of depth on how far these are.
//   scatter = stored block of colours, range-coded (range_coder.h); stored block of bits. These are of each pixel depth
//   and the normal's bytes by Golomb's codes.
//   Normals are turned by the tile's pole, which stands before (tile.h).
//   A pixel's colour is as predicted, or has green's residual, and then is the last one of that green, or has the
//   residuals of blue and red less that of green. Where a ramp gave colours, it is predicted by height (ramp.h).
// Within bounds (lattice.h) residuals are steps from where the prediction lies, and a colour is as predicted if it is
// near enough.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/codec/golomb.h"
#include "common/codec/lattice.h"
#include "common/codec/range_coder.h"
#include "common/codec/sparse/ramp.h"
#include "common/codec/sparse/scatter.h"

namespace telesplat::codec::detail {

/// Contexts of one tile.
struct ScatterContexts {
  static constexpr int kDepthBits = 24, kByteBits = 8;  // the most that a residual takes
  void start();
  GolombContext depth[kDepthBits + 1][Guess::kMostDistance + 1];  // [expected][distance]
  GolombContext normal[2][kByteBits + 1][5];                      // [component][expected][of the other component]
  AdaptiveBit plain[4];                                           // [plain_colour]
  AdaptiveBit plain_ramp[Ramp::kNothing];                         // [gap]
  SignedModel ramp[Ramp::kNothing];                               // green's: [gap]
  AdaptiveBit again[4];                                           // [how far it is from what is predicted]
  SignedModel colour[3][kByteBits + 1];                           // [channel][expected; of the channel before]
  std::array<int32_t, 256> last_of_green;                         // a colour; -1: there was none
};

class ScatterEncoder {
 public:
  /// `count` pixels follow. `bounds` and `ramp`, which is null or was started, must outlive them.
  void start(size_t count, const TileBounds& bounds, Ramp* ramp);
  /// `pixel`, at (x, y) in the tile, becomes what is decoded.
  Magnitudes put(int x, int y, Pixel& pixel, const Guess& guess);
  void finish(std::vector<uint8_t>& out);

 private:
  ScatterContexts contexts_;
  const TileBounds* bounds_ = nullptr;
  Ramp* ramp_ = nullptr;
  std::vector<uint8_t> colours_;
  RangeEncoder colour_coder_{colours_};
  BitWriter bits_;
};

class ScatterDecoder {
 public:
  /// Reads what pixels are made of; false where it is damaged. The bytes of `in` must outlive the last pixel.
  [[nodiscard]] bool start(Reader& in, const TileBounds& bounds, Ramp* ramp);
  /// Nothing where the stream is damaged.
  std::optional<Pixel> get(int x, int y, const Guess& guess, Magnitudes& magnitudes);
  /// All bits were taken.
  [[nodiscard]] bool finished() const { return bits_.finished() && colour_coder_.finished(); }

 private:
  ScatterContexts contexts_;
  const TileBounds* bounds_ = nullptr;
  Ramp* ramp_ = nullptr;
  RangeDecoder colour_coder_;
  BitReader bits_;
};

}  // namespace telesplat::codec::detail
