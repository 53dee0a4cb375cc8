// From a tile's pixels to bytes and back: dense tiles in rows (predict.h), by token streams; sparse ones from coarse to
// fine (scatter.h).
#pragma once

#include <cstddef>

#include "common/codec/mask.h"
#include "common/codec/predict.h"
#include "common/codec/scatter.h"
#include "common/codec/scatter_coder.h"
#include "common/codec/streams.h"
#include "common/image/depth_image.h"

namespace telesplat::codec::detail {

/// A rectangle of an image. `first`: index of its upper left pixel; `stride`: the image's width.
struct TileRect {
  size_t first, stride;
  int width, height;
  size_t index(int x, int y) const { return first + stride * static_cast<size_t>(y) + static_cast<size_t>(x); }
};

/// Buffers that one thread keeps: a tile is too small to allocate them anew.
struct TileScratch {
  void reset(size_t width) {
    for (FilledRow& row : rows) row.reset(width);
    residuals.reset(width);
    packed.reset(width);
    for (JoinedRow* row : {&decoded[0], &decoded[1], &decoded_residuals, &decoded_packed}) row->reset(width);
  }
  Mask mask;
  FilledRow rows[2];
  Residuals residuals, packed;  ///< of a row; of its covered pixels alone
  JoinedRow decoded[2], decoded_residuals, decoded_packed;
  ScatterWalk scatter_walk;
  ScatterPredictor predictor;
  ScatterEncoder scatter_encoder;
  ScatterDecoder scatter_decoder;
  TokenWriter writer;
  TokenReader reader;
};

/// Pixels covered by s.mask -> s.writer, or of sparse tiles s.scatter_encoder, which was started. `base`: what predicts
/// the first pixel. `full`: the mask is all ones.
void encode_dense(TileScratch& s, const image::DepthImage& image, const TileRect& rect, const Pixel& base, bool full);
void encode_sparse(TileScratch& s, const image::DepthImage& image, const TileRect& rect, const Pixel& base);

/// s.reader, of sparse tiles s.scatter_decoder, which was started -> pixels covered by s.mask; others are left alone
/// (they are zero). False where the stream is damaged.
[[nodiscard]] bool decode_full(TileScratch& s, image::DepthImage& image, const TileRect& rect, const Pixel& base);
[[nodiscard]] bool decode_masked(TileScratch& s, image::DepthImage& image, const TileRect& rect, const Pixel& base);
[[nodiscard]] bool decode_sparse(TileScratch& s, image::DepthImage& image, const TileRect& rect, const Pixel& base);

}  // namespace telesplat::codec::detail
