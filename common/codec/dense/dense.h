// One dense tile's pixels <-> bytes. docs/codec.md describes the stream.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/codec/dense/colours.h"
#include "common/codec/dense/depth.h"
#include "common/codec/dense/normals.h"
#include "common/codec/depth_codec.h"
#include "common/codec/entropy.h"
#include "common/codec/tile_rect.h"
#include "common/image/depth_image.h"

namespace telesplat::codec::detail {

struct DenseTile {
  const TileRect& rect;
  const Mask* mask;   ///< pixels of `rect` that are coded; null: all of them
  const Pixel& base;  ///< the first of them; its depth is an index of the bounds' lattice, if there is one
  const TileBounds& bounds;
};

/// Codes dense tiles. Use one a thread: it keeps its buffers.
class DenseCoder {
 public:
  /// axes: of the room, from the tile's centre, or null.
  void put(std::vector<uint8_t>& out, const image::DepthImage& image, const DenseTile& tile, const RoomAxes* axes);
  /// Writes the tile's pixels; false where the stream is damaged.
  [[nodiscard]] bool get(Reader& in, image::DepthImage& image, const DenseTile& tile);
  /// Adds the bytes of a tile to `info`. False: the stream is cut off.
  [[nodiscard]] static bool skip(Reader& in, StreamInfo& info);

 private:
  static constexpr size_t kPartCount = 3;  ///< depth, normals, colour
  struct Parts {
    ColourPlanes::Mode colour_mode = ColourPlanes::kPlain;
    std::span<const uint8_t> headers[kPartCount], words, states;
    size_t word_bytes[kPartCount] = {};
  };
  static std::optional<Parts> get_parts(Reader& in);
  SymbolPlane& plane(size_t i);
  size_t planes_until(size_t part) const;
  void put_header(std::vector<uint8_t>& out, size_t part);
  [[nodiscard]] bool put_words(std::vector<uint8_t>& out);
  void begin_part(const Parts& parts, size_t part);
  [[nodiscard]] bool get_depth(const Parts& parts, image::DepthImage& image, const TileRect& rect, const Pixel& base,
                               const DepthLattice* lattice);
  [[nodiscard]] bool get_symbols(size_t part);
  void get_values(image::DepthImage& image, const TileRect& rect);
  template <class T>
  void clear_gaps(size_t y, T* row) const;

  TileShape shape_;
  DepthPlane depth_;
  NormalPlanes normals_;
  ColourPlanes colours_;
  static constexpr size_t kMostPlanes = 6;
  PlaneEncoder encoders_[kMostPlanes];
  PlaneDecoder decoders_[kMostPlanes];
  SymbolDecoder source_;
  BitWriter writer_;
  BitReader reader_;
  std::vector<uint8_t> words_;
};

}  // namespace telesplat::codec::detail
