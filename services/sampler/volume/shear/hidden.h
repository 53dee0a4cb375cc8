// Early termination: which pixels nearer layers hide, also from eyes a little beside the sampled one.
#pragma once

#include <cstdint>
#include <vector>

namespace telesplat::sampler {

/// Bits of a raster's pixels, in bytes of 8 pixels, rows of blocks_across bytes.
class HiddenPixels {
 public:
  HiddenPixels(int width, int height);
  uint8_t* bytes() { return bytes_.data(); }
  const uint8_t* bytes() const { return bytes_.data(); }
  int blocks_across() const { return across_; }

  /// Keeps the pixels whose neighbours, to `dx` and `dy` pixels on all sides, have all been set. Beyond the raster
  /// everything is.
  void shrink(int dx, int dy);

 private:
  int width_, height_, across_;
  std::vector<uint8_t> bytes_;
};

}  // namespace telesplat::sampler
