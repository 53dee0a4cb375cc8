// One image a layer, laid out for the warp, made from the slabs' images of the layer when all have come.
//
// Slabs share out the pixels of every *slice* (owned_pixels), but in a layer of many slices the borders lie elsewhere
// in each, so that images of neighbouring slabs overlap by some pixels. Warped one by one they would leave a seam: with
// bilinear weights f and 1 - f on both sides of a border, "over" gives 1 - (1 - f)(1 - (1 - f)) < 1 of an opaque layer.
// So they are composited pixel by pixel of the raster first, where each pixel's ray is known exactly; the warp then
// interpolates one image without slabs.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "common/volume/shear.h"
#include "common/volume/slices/image.h"

namespace telesplat::volume {

/// A rectangle of the frame's raster, outside which the layer is transparent, with a transparent frame of one pixel to
/// the left of and above it and two to the right and below, so that a bilinear look-up anywhere within a pixel of it
/// stays inside.
struct LayerImage {
  static constexpr int kBlock = 16;  ///< texels a side of a block in `filled`

  int layer = 0;        ///< index in ShearFrame::layers
  geometry::Rect rect;  ///< rectangle in the raster; at least one pixel
  int pitch = 0;        ///< texels from row to row: rect.width + 3
  /// (rect.height + 3) rows; 0xAARRGGBB, premultiplied. Raster pixel (rect.x + x, rect.y + y) is texel (x + 1, y + 1).
  std::vector<uint32_t> texels;
  /// One byte for each block of kBlock x kBlock texels, rows of block_pitch: not 0 if it, its right, its lower or its
  /// lower right neighbour is not empty. One row and column of blocks more than texels have.
  std::vector<uint8_t> filled;
  int block_pitch = 0;

  int rows() const { return rect.height + 3; }
  const uint32_t* row(int y) const { return texels.data() + static_cast<ptrdiff_t>(y + 1) * pitch + 1; }
  /// True if any of texels [x0, x1] x [y0, y1] may be visible. Precondition: they exist, x0 <= x1, y0 <= y1.
  bool may_fill(int x0, int y0, int x1, int y1) const;
};

/// Indices of slabs' images in the order in which rays from `eye` (index coordinates) go through them, nearest first,
/// within each layer: by the distance of [k_begin - 0.5, k_end - 0.5) from the eye along k. Layers keep the frame's
/// order.
std::vector<int> slab_order(std::span<const SliceImage> images, const glm::dvec3& eye);

/// Composites all images of a layer with "over", nearest slab first seen from shear.eye, pixel by pixel; layers in
/// order, those without images left out. Drops images whose layer or rectangle does not fit this frame, or whose
/// number of pixels does not fit the rectangle.
std::vector<LayerImage> merge_layers(std::span<const SliceImage> images, const ShearFrame& shear);

}  // namespace telesplat::volume
