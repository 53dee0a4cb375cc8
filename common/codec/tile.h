// One tile's pixels <-> bytes. docs/codec.md describes the stream.
//   tile = u8 kind, and unless it is empty: base, [mask], and a dense tile (dense/dense.h) or a sparse one
//          (sparse/scatter_coder.h)
//   kind = kEmpty | kDense | kSparse, + kMasked unless all pixels are covered
//   base = depth (3 bytes; within bounds its index), colour (3), normal (2) of the first covered pixel
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/codec/dense/dense.h"
#include "common/codec/depth_codec.h"
#include "common/codec/entropy.h"
#include "common/codec/mask.h"
#include "common/codec/room_axes.h"
#include "common/codec/sparse/ramp.h"
#include "common/codec/sparse/scatter.h"
#include "common/codec/sparse/scatter_coder.h"
#include "common/image/depth_image.h"

namespace telesplat::codec::detail {

/// Most pixels of a tile; every tile takes at least a byte.
inline constexpr size_t kMaxTilePixels = size_t{1} << 16;

/// Divides an image of width x height pixels into tiles of tile_width x tile_height; tiles at the right and bottom are
/// cut off.
struct TileGrid {
  /// one: all of the image is a single tile, which must be sparse.
  TileGrid(int width, int height, bool one = false);
  TileRect rect(int column, int row) const;
  int width, height, tile_width, tile_height, columns, rows;
};

/// Buffers that a thread keeps: a tile is too small to allocate them anew.
struct TileScratch {
  Mask mask;
  ScatterWalk scatter_walk;
  ScatterPredictor predictor;
  Ramp ramp;
  ScatterEncoder scatter_encoder;
  ScatterDecoder scatter_decoder;
  DenseCoder dense;
};

/// Puts the pixels of a sparse tile that s.mask covers into s.scatter_encoder, which was started. base: prediction of
/// the first pixel. pole: turns normals; kRaw: codes them unchanged.
void encode_sparse(TileScratch& s, const image::DepthImage& image, const TileRect& rect, const Pixel& base, int pole);

/// True if an image is coded as one tile: its pixels lie in several sparse tiles, and one tile nearly always takes
/// fewer bytes.
bool is_one_tile(const image::DepthImage& image, const TileBounds& bounds);

/// Appends the pixels of `rect`; returns the number of covered ones. axes: of the room, from the tile's centre, or
/// null.
size_t put_tile(std::vector<uint8_t>& out, const image::DepthImage& image, const TileRect& rect,
                const TileBounds& bounds, const RoomAxes* axes = nullptr);
/// Writes all pixels of `rect`; returns the number of covered ones, or nothing if the stream is damaged.
std::optional<size_t> get_tile(Reader& in, image::DepthImage& image, const TileRect& rect, const TileBounds& bounds);
/// Adds the covered pixels and the bytes of a tile of the size of `rect` to `info`. False: the stream is damaged.
[[nodiscard]] bool skip_tile(Reader& in, const TileRect& rect, StreamInfo& info);

}  // namespace telesplat::codec::detail
