// Slice images: a sampler makes one a layer from its slab. Coded in independent blocks, so that the packer can leave
// out blocks that a viewer does not see without decoding any.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/core/result.h"
#include "common/geometry/camera.h"

namespace telesplat::volume {

inline constexpr int kSliceBlock = 64;  ///< pixels a side; blocks begin at multiples of it in the raster

/// One layer's image of one slab: a rectangle of the frame's raster, outside which it is transparent.
struct SliceImage {
  int layer = 0;                 ///< index in ShearFrame::layers
  int k_begin = 0, k_end = 0;    ///< the slab
  geometry::Rect rect;           ///< in the raster; at least one pixel
  std::vector<uint32_t> pixels;  ///< rect.width x rect.height, 0xAARRGGBB, colours premultiplied by alpha
};

/// An encoded image's block, in place.
struct EncodedBlock {
  int x = 0, y = 0;  ///< block column and row in the raster
  std::span<const uint8_t> bytes;
};
/// An encoded image, split into parts without decoding. Spans point into the parsed bytes.
struct EncodedSlice {
  int layer = 0, k_begin = 0, k_end = 0;
  std::span<const uint8_t> tables;   ///< tables of all blocks (block.h)
  std::vector<EncodedBlock> blocks;  ///< blocks that are not wholly transparent, in order of rows
};

/// The smallest rectangle that holds all blocks, clipped to the raster: the rectangle of the decoded image. Callers
/// with bytes from outside should add these up before decoding: two blocks in opposite corners claim a whole raster.
/// Precondition: from parse_slices() with that raster, not empty.
geometry::Rect bounds(const EncodedSlice& slice, int raster_width, int raster_height);

/// Leaves out blocks that are wholly transparent; an image without others becomes no bytes. Before the blocks (block.h)
/// come u16 layer, k_begin, k_end, number of blocks, and number of bytes of the tables; the tables; then for each block
/// u8 column, u8 row, u16 bytes (little-endian). Precondition: rect lies in [0, kMaxRasterSide]^2, pixels has its size,
/// k_begin < k_end <= kMaxSide.
std::vector<uint8_t> encode_slice(const SliceImage& image);
/// Splits encoded images, one after the other, into slices, all with blocks. raster: width and height, layers: number;
/// refuses slices that do not fit them. Bytes come from outside; only decode_slice_into() checks blocks' insides.
Result<std::vector<EncodedSlice>> parse_slices(std::span<const uint8_t> bytes, int raster_width, int raster_height,
                                               int layers);
/// The inverse; leaves out slices without blocks.
std::vector<uint8_t> join_slices(std::span<const EncodedSlice> slices);
/// Decodes all blocks; the image's rectangle is bounds(). Reuses the image's memory; after an error its content is
/// undefined. Error: a block is not valid. Precondition: as bounds().
Status decode_slice_into(SliceImage& image, const EncodedSlice& slice, int raster_width, int raster_height);

inline constexpr size_t kMaxSlices = size_t{64} << 10;  ///< at once: layers times slabs

}  // namespace telesplat::volume
