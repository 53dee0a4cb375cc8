// Sparse tiles from pixels to residuals and back, from coarse to fine (scatter.h).
#pragma once

#include <cstddef>

#include "common/codec/dense/dense.h"
#include "common/codec/mask.h"
#include "common/codec/poles.h"
#include "common/codec/sparse/ramp.h"
#include "common/codec/sparse/scatter.h"
#include "common/codec/sparse/scatter_coder.h"
#include "common/image/depth_image.h"

namespace telesplat::codec::detail {

/// Buffers that one thread keeps: a tile is too small to allocate them anew.
struct TileScratch {
  Mask mask;
  ScatterWalk scatter_walk;
  ScatterPredictor predictor;
  Ramp ramp;
  ScatterEncoder scatter_encoder;
  ScatterDecoder scatter_decoder;
  DenseCoder dense;
};

/// Pixels of a sparse tile that s.mask covers -> s.scatter_encoder, which was started. `base`: what predicts the first
/// pixel. pole: by which normals are turned; kRaw: they are coded as they are.
void encode_sparse(TileScratch& s, const image::DepthImage& image, const TileRect& rect, const Pixel& base, int pole);
/// s.scatter_decoder, which was started -> pixels covered by s.mask; others are left alone (they are zero). False where
/// the stream is damaged.
[[nodiscard]] bool decode_sparse(TileScratch& s, image::DepthImage& image, const TileRect& rect, const Pixel& base,
                                 int pole);

}  // namespace telesplat::codec::detail
