// Slice images: what a sampler makes of its slab, one a layer, and how they travel. Coded in blocks, each by itself, so
// that the packer can leave out blocks a viewer does not see without decoding any.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/core/result.h"
#include "common/geometry/camera.h"

namespace telesplat::volume {

inline constexpr int kSliceBlock = 64;  ///< pixels a side; blocks lie on the raster's grid of multiples of it

/// One layer's image of one slab: a rectangle of the frame's raster, outside which it is transparent.
struct SliceImage {
  int layer = 0;                 ///< of ShearFrame::layers
  int k_begin = 0, k_end = 0;    ///< the slab
  geometry::Rect rect;           ///< in the raster; at least one pixel
  std::vector<uint32_t> pixels;  ///< rect.width x rect.height, 0xAARRGGBB, colours premultiplied by alpha
};

/// An encoded image's block, in place.
struct EncodedBlock {
  int x = 0, y = 0;  ///< block column and row in the raster
  std::span<const uint8_t> bytes;
};
/// An encoded image, taken apart without decoding. Spans point into what was parsed.
struct EncodedSlice {
  int layer = 0, k_begin = 0, k_end = 0;
  std::span<const uint8_t> tables;   ///< of all blocks (block.h)
  std::vector<EncodedBlock> blocks;  ///< those with anything in them, in order of rows
};

/// The smallest rectangle that holds all blocks, clipped to the raster: of the image as it is decoded. Who
/// decodes what comes from outside should add these up first: two blocks in opposite corners claim a whole raster.
/// Precondition: from parse_slices() with that raster, not empty.
geometry::Rect bounds(const EncodedSlice& slice, int raster_width, int raster_height);

/// Blocks that are wholly transparent are left out; of an image without any other nothing is left: no bytes. Before the
/// blocks (block.h) stand u16 layer, k_begin, k_end, the number of blocks, and of the bytes of the tables; the tables;
/// then of each block u8 column, u8 row, u16 bytes (little-endian). Precondition: rect lies in [0, kMaxRasterSide]^2,
/// pixels has its size, k_begin < k_end <= kMaxSide.
std::vector<uint8_t> encode_slice(const SliceImage& image);
/// Encoded images one after the other -> slices, none of them empty. raster: width and height, layers: how many; what
/// does not fit them is refused. Bytes come from outside; blocks' insides are looked at by decode_slice_into() only.
Result<std::vector<EncodedSlice>> parse_slices(std::span<const uint8_t> bytes, int raster_width, int raster_height,
                                               int layers);
/// The other way; slices without blocks are left out.
std::vector<uint8_t> join_slices(std::span<const EncodedSlice> slices);
/// Decodes all blocks; the image's rectangle is bounds(). The image may have been used before, for its memory; what it
/// holds after an error is undefined. Error: a block that is no such block. Precondition: as bounds().
Status decode_slice_into(SliceImage& image, const EncodedSlice& slice, int raster_width, int raster_height);

inline constexpr size_t kMaxSlices = size_t{64} << 10;  ///< in one go: layers times slabs

}  // namespace telesplat::volume
