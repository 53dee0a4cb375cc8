// Holds the images that a frame passes through on the GPU, and copies them to host memory.
#pragma once

#include <cstdint>

#include "common/core/result.h"
#include "common/splat/cpu_splatter.h"

namespace telesplat::viewer {

/// Textures and their frame buffers. "Padded" ones have kMargin more pixels on all sides, since GL drops points of any
/// size whose centre is outside. Every member function needs a current GL context.
class FrameTargets {
 public:
  static constexpr int kMargin = 16;  // splat::kMaxSplatSide: no splat reaches farther from its centre

  FrameTargets() = default;
  ~FrameTargets();
  FrameTargets(const FrameTargets&) = delete;
  FrameTargets& operator=(const FrameTargets&) = delete;

  /// Does nothing if the size is the same. Error: the GPU cannot hold such a frame; names the limit, and width() is 0.
  Status resize(int width, int height);
  /// Makes the accumulators of kernels that add up (splat::Passes::kSums), at the first call.
  Status make_sums();

  int width() const { return width_; }
  int height() const { return height_; }
  int padded_width() const { return width_ + 2 * kMargin; }
  int padded_height() const { return height_ + 2 * kMargin; }

  // Textures.
  uint32_t keys() const { return textures_[kKeys]; }            ///< padded, RG32UI: low and high half of a pixel's key
  uint32_t visible() const { return textures_[kVisible]; }      ///< padded, depth component of the depth test
  uint32_t sums(int i) const { return textures_[kSums0 + i]; }  ///< padded, RGBA32F: weighted sums, 2 of them
  uint32_t pairs(int i) const { return textures_[kPairs0 + i]; }  ///< padded, RG32UI: colour and info, 2 of them

  // Frame buffers.
  enum Buffer { kSplat, kVisibility, kSumming, kPair0, kPair1, kOutput, kOutputColour, kBuffers };
  /// Binds the buffer for drawing and sets the viewport.
  void draw_to(Buffer buffer) const;
  uint32_t framebuffer(Buffer buffer) const { return framebuffers_[buffer]; }

 private:
  enum Texture { kKeys, kVisible, kSums0, kSums1, kPairs0, kPairs1, kColour, kDepth, kTextures };
  void release();
  void make_texture(Texture which, uint32_t format, bool padded);
  Status make_framebuffer(Buffer which, const uint32_t* colours, int count, bool with_depth_test);

  int width_ = 0, height_ = 0;
  uint32_t textures_[kTextures] = {}, framebuffers_[kBuffers] = {};
};

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
  size_t bytes_ = 0;  // size of each buffer
};

}  // namespace telesplat::viewer
