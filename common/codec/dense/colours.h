// Colours of a dense tile: one for all, a palette, or three channels.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/codec/dense/depth.h"
#include "common/codec/dense/guided.h"
#include "common/codec/dense/height.h"
#include "common/codec/lattice.h"

namespace telesplat::codec::detail {

/// Whether all covered pixels have that colour.
bool of_one_colour(const TileShape& shape, const PixelRows<uint32_t>& colours, uint32_t colour);

struct ColourPlanes {
  enum Mode : uint8_t { kPlain = 0, kPalette = 1, kChannels = 2, kDifferences = 3 };  ///< of red and blue to green
  static constexpr size_t kMostColours = 1024;

  /// colours: row by row in all the tile's width, of covered pixels; `base`: of the first.
  /// known: of where pixels look. reach: how far a channel may be off.
  void encode(const TileShape& shape, const PixelRows<uint32_t>& colours, uint32_t base, const DepthPlane& depth,
              const KnownAxes& known, int reach);
  size_t planes() const { return mode == kPlain ? 0 : mode == kPalette ? 1 : 3; }
  SymbolPlane& symbols(size_t i) { return mode == kPalette ? index.symbols : channel[i].symbols; }
  void put_header(BitSink& bits) const;
  /// About what the header takes.
  size_t header_bits() const { return mode == kPalette ? 10 * palette_.size() + (has_height_ ? 400 : 0) : 24; }
  size_t most_header_bits() const { return 4096 + 3 * 51 * kMostColours + GuidedPlane::kMostWeightBits; }
  [[nodiscard]] bool decode_header(const TileShape& shape, const DepthPlane& depth, int reach, BitReader& bits);
  /// Row y from its symbols, into colours of all its pixels. With a palette: decode_sums() and decode_values() of its
  /// index, and get_colours().
  void decode_row(const TileShape& shape, size_t y, uint32_t* colours);
  void get_colours(const TileShape& shape, size_t y, uint32_t* colours);

  Mode mode = kPlain;
  GuidedPlane index;  ///< into the palette

 private:
  struct Channel {
    Plane<uint8_t> values;
    SymbolPlane symbols;
  };
  bool make_palette(const TileShape& shape, const PixelRows<uint32_t>& colours);
  void sort_palette(const TileShape& shape, const DepthPlane& depth, const KnownAxes& known);
  std::vector<int16_t> join_palette(int reach);
  void encode_palette(const TileShape& shape, int reach);
  void sort_by_height(const TileShape& shape, const DepthPlane& depth);
  void try_channels(const TileShape& shape, const PixelRows<uint32_t>& colours);
  void encode_channels(const TileShape& shape, const PixelRows<uint32_t>& colours);
  void find_heights(const TileShape& shape, const DepthPlane& depth);
  void begin_index(const TileShape& shape);
  void begin_channels(const TileShape& shape);

  std::vector<uint32_t> palette_;
  std::vector<HeightSample> first_, height_samples_;  ///< first_: a pixel of each colour
  ColourLattice lattice_{0};                          ///< of channels
  bool has_height_ = false;
  HeightModel height_;
  std::array<Channel, 3> channel;  // green, red, blue
  Samples samples_;
};

}  // namespace telesplat::codec::detail
