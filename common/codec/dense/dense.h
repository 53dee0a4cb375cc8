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

/// What codes dense tiles. One a thread: it keeps its memory.
class DenseCoder {
 public:
  /// Appends the pixels of `rect`, all of them or those that `mask` covers. `base`: the first of them; its depth is an
  /// index of the bounds' lattice, if there is one. axes: of the room, from the tile's centre, or null.
  void put(std::vector<uint8_t>& out, const image::DepthImage& image, const TileRect& rect, const Mask* mask,
           const Pixel& base, const TileBounds& bounds, const RoomAxes* axes);
  /// Writes the covered pixels of `rect`; false where the stream is damaged.
  [[nodiscard]] bool get(Reader& in, image::DepthImage& image, const TileRect& rect, const Mask* mask,
                         const Pixel& base, const TileBounds& bounds);
  /// Adds the bytes of a tile with `covered` pixels to `info`; false where the stream is cut off.
  [[nodiscard]] static bool skip(Reader& in, StreamInfo& info);

 private:
  static constexpr size_t kPartCount = 3;  ///< depth, normals, colour
  struct Parts {
    ColourPlanes::Mode colour_mode = ColourPlanes::kPlain;
    std::span<const uint8_t> headers[kPartCount], words, states;
    size_t word_bytes[kPartCount] = {};
  };
  static std::optional<Parts> get_parts(Reader& in);
  void begin(const TileRect& rect, const Mask* mask);
  void load_depth(const image::DepthImage& image, const TileRect& rect);
  template <class T>
  PixelRows<T> rows_of(const std::vector<T>& plane, const TileRect& rect, std::vector<T>& copy) const;
  void put_words(std::vector<uint8_t>& out);
  void begin_part(const Parts& parts, size_t part);
  [[nodiscard]] bool get_depth(const Parts& parts, image::DepthImage& image, const TileRect& rect, const Pixel& base,
                               const DepthLattice* lattice);
  [[nodiscard]] bool get_normals(const Parts& parts, const Pixel& base, int reach);
  [[nodiscard]] bool get_colours(const Parts& parts, int reach);
  template <class Planes>
  [[nodiscard]] bool get_symbols(size_t first, size_t count, Planes plane);
  void get_values(image::DepthImage& image, const TileRect& rect, const Pixel& base);
  template <class T>
  T* row_for(std::vector<T>& out, const TileRect& rect, size_t y, std::vector<T>& scratch) const;
  template <class T>
  void store(const T* row, size_t y, std::vector<T>& out, const TileRect& rect) const;

  TileShape shape_;
  Mask line_mask_;
  DepthPlane depth_;
  NormalPlanes normals_;
  ColourPlanes colours_;
  std::vector<uint32_t> colour_rows_;
  std::vector<uint16_t> normal_rows_;
  PlaneEncoder encoders_[6];
  PlaneDecoder decoders_[6];
  WordSource source_;
  BitWriter writer_;
  BitReader reader_;
  std::vector<uint8_t> words_;
};

}  // namespace telesplat::codec::detail
