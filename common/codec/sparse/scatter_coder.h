// The residuals of scattered pixels <-> bits. The expected distance of depth and normals from their predictions depends
// on the neighbours: their errors, their distance and how alike they are.
//   scatter = stored block, range-coded (range_coder.h): for each pixel depth, the normal's bytes (spread.h), colour.
//   Normals are turned by the tile's pole, which is stored before (tile.h).
//   A pixel's colour is as predicted; or has green's residual, and then is the last colour with that green, or has the
//   residuals of blue and red less that of green. If a ramp gave the colours, height predicts them (ramp.h).
// Within bounds (lattice.h) numbers are steps of lattices, and a colour counts as predicted if it is near enough.
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
  static constexpr int kByteBits = 8;  // most bits of a residual
  void start();
  SpreadModel depth, normal[2];
  AdaptiveBit plain[4];                    // [plain_colour]
  AdaptiveBit plain_ramp[Ramp::kNothing];  // [gap]
  SignedModel ramp[Ramp::kNothing];        // green's: [gap]
  AdaptiveBit again[4];                    // [distance from the prediction]
  SignedModel colour[3][kByteBits + 1];    // [channel][expected; of the channel before]
  std::array<int32_t, 256> last_of_green;  // last colour with this green; -1: none yet
};

class ScatterEncoder {
 public:
  /// `bounds` and `ramp` must outlive the coder. ramp: null, or started.
  void start(const TileBounds& bounds, Ramp* ramp);
  /// Codes `pixel`, at (x, y) in the tile, and sets it to the decoded one.
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
  /// Opens the coded block. False: it is damaged. The bytes of `in` must outlive the last pixel.
  [[nodiscard]] bool start(Reader& in, const TileBounds& bounds, Ramp* ramp);
  /// Decodes a pixel; nothing if the stream is damaged.
  std::optional<Pixel> get(int x, int y, const Guess& guess, Magnitudes& magnitudes);
  /// True if all bytes were taken.
  [[nodiscard]] bool finished() const { return coder_.finished(); }

 private:
  ScatterContexts contexts_;
  const TileBounds* bounds_ = nullptr;
  Ramp* ramp_ = nullptr;
  RangeDecoder coder_;
};

}  // namespace telesplat::codec::detail
