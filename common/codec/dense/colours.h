// Colours of a dense tile: one for all, a palette, or three channels.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/codec/dense/depth.h"
#include "common/codec/dense/guided.h"
#include "common/codec/lattice.h"
#include "common/codec/sparse/ramp.h"

namespace telesplat::codec::detail {

/// True if all covered pixels have that colour.
bool has_one_colour(const TileShape& shape, const PixelRows<uint32_t>& colours, uint32_t colour);

struct ColourPlanes {
  enum Mode : uint8_t { kPlain = 0, kPalette = 1, kChannels = 2 };
  static constexpr size_t kMostColours = 1024;

  /// colours: of covered pixels, row by row in the tile's full width; `base`: of the first one. axes: the room's, from
  /// the tile's centre, or null. reach: largest error of a channel.
  void encode(const TileShape& shape, const PixelRows<uint32_t>& colours, uint32_t base, const DepthPlane& depth,
              const RoomAxes* axes, int reach);
  size_t planes() const { return mode == kPlain ? 0 : mode == kPalette ? 1 : 3; }
  SymbolPlane& symbols(size_t i) { return plane_[i].symbols; }
  void put_header(BitSink& bits) const;
  static constexpr size_t kMostHeaderBits = 256 + 51 * (3 * kMostColours + kKnots) + 3 * GuidedPlane::kMostWeightBits;
  [[nodiscard]] bool decode_header(const TileShape& shape, uint32_t base, const DepthPlane& depth, int reach,
                                   BitReader& bits);
  /// Makes the colours of all pixels of row y from its symbols.
  void decode_row(const TileShape& shape, size_t y, uint32_t* colours);

  Mode mode = kPlain;

 private:
  bool make_palette(const TileShape& shape, const PixelRows<uint32_t>& colours);
  void sort_palette(const TileShape& shape, const DepthPlane& depth, const RoomAxes* axes);
  void begin_index(const TileShape& shape);
  void begin_channels(const TileShape& shape);
  void find_heights(const TileShape& shape, const DepthPlane& depth);

  uint32_t base_ = 0;
  std::vector<uint32_t> palette_;
  std::optional<RampAxis> ramp_;  ///< sorts the palette; knots_ has the index at each height
  std::array<int16_t, kKnots> knots_;
  ColourLattice lattice_{0};          ///< lattice of all three channels
  std::array<GuidedPlane, 3> plane_;  ///< the palette's index, or green, red and blue
  Samples samples_;
};

}  // namespace telesplat::codec::detail
