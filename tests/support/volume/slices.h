// Slice images coded and decoded in one call each.
#pragma once

#include <vector>

#include "common/volume/slices/image.h"

namespace telesplat::volume {

/// Appends the coded slice to `out`.
inline void encode_slice(const SliceImage& image, std::vector<uint8_t>& out) {
  const std::vector<uint8_t> bytes = encode_slice(image);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

inline Result<SliceImage> decode_slice(const EncodedSlice& slice, int raster_width, int raster_height) {
  SliceImage image;
  if (const Status s = decode_slice_into(image, slice, raster_width, raster_height); !s) return s.error();
  return image;
}

}  // namespace telesplat::volume
