// The residuals of scattered pixels <-> bits. How far depth and normals are expected to lie from their predictions
// depends on how wrong those of neighbours were, how far apart these lie and how alike they are.
//   scatter = stored block, range-coded (range_coder.h): of each pixel depth, the normal's bytes (spread.h), colour.
//   Normals are turned by the tile's pole, which stands before (tile.h).
//   A pixel's colour is as predicted, or has green's residual, and then is the last one of that green, or has the
//   residuals of blue and red less that of green. Where a ramp gave colours, it is predicted by height (ramp.h).
// Within bounds (lattice.h) numbers are steps of lattices, and a colour is as predicted if it is near enough.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/codec/lattice.h"
#include "common/codec/range_coder.h"
#include "common/codec/sparse/ramp.h"
#include "common/codec/sparse/scatter.h"
#include "common/codec/sparse/spread.h"

namespace telesplat::codec::detail {

/// Contexts of one tile.
struct ScatterContexts {
  static constexpr int kByteBits = 8;  // the most that a residual takes
  void start();
  SpreadModel depth, normal[2];
  AdaptiveBit plain[4];                    // [plain_colour]
  AdaptiveBit plain_ramp[Ramp::kNothing];  // [gap]
  SignedModel ramp[Ramp::kNothing];        // green's: [gap]
  AdaptiveBit again[4];                    // [how far it is from what is predicted]
  SignedModel colour[3][kByteBits + 1];    // [channel][expected; of the channel before]
  std::array<int32_t, 256> last_of_green;  // a colour; -1: there was none
};

class ScatterEncoder {
 public:
  /// `bounds` and `ramp`, which is null or was started, must outlive them.
  void start(const TileBounds& bounds, Ramp* ramp);
  /// `pixel`, at (x, y) in the tile, becomes what is decoded.
  Magnitudes put(int x, int y, Pixel& pixel, const Guess& guess);
  void finish(std::vector<uint8_t>& out);

 private:
  ScatterContexts contexts_;
  const TileBounds* bounds_ = nullptr;
  Ramp* ramp_ = nullptr;
  std::vector<uint8_t> bytes_;
  RangeEncoder coder_{bytes_};
};

class ScatterDecoder {
 public:
  /// Reads what pixels are made of; false where it is damaged. The bytes of `in` must outlive the last pixel.
  [[nodiscard]] bool start(Reader& in, const TileBounds& bounds, Ramp* ramp);
  /// Nothing where the stream is damaged.
  std::optional<Pixel> get(int x, int y, const Guess& guess, Magnitudes& magnitudes);
  /// All bytes were taken.
  [[nodiscard]] bool finished() const { return coder_.finished(); }

 private:
  ScatterContexts contexts_;
  const TileBounds* bounds_ = nullptr;
  Ramp* ramp_ = nullptr;
  RangeDecoder coder_;
};

}  // namespace telesplat::codec::detail
