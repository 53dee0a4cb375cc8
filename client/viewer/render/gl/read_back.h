// From the GPU's finished frame to host memory.
#pragma once

#include <cstdint>

#include "common/splat/cpu_splatter.h"

namespace telesplat::viewer {

/// Reads colour and depth of a frame. Through pixel-pack buffers the GPU copies both right after its last pass, and the
/// caller waits once. A software renderer's frame already lies in host memory, so pixel-pack buffers would only add a
/// copy.
class ReadBack {
 public:
  explicit ReadBack(bool pack_buffers) : pack_buffers_(pack_buffers) {}
  ~ReadBack();
  ReadBack(const ReadBack&) = delete;
  ReadBack& operator=(const ReadBack&) = delete;

  /// framebuffer: RGBA8 at attachment 0 and, if target.depth_m is set, R32F at attachment 1, both of the target's size.
  void read(uint32_t framebuffer, const splat::FrameTarget& target);

 private:
  void read_image(uint32_t attachment, bool is_colour, const splat::FrameTarget& target, void* to);

  bool pack_buffers_;
  uint32_t buffers_[2] = {};
  size_t bytes_ = 0;  // of each buffer
};

}  // namespace telesplat::viewer
