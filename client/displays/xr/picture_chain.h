// The textures that an eye's pictures go into.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "client/displays/xr/xr_system.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// 0xAARRGGBB to bytes R G B A.
void to_rgba(const uint32_t* colour, size_t pixels, uint32_t* out);

/// How depth is told to a headset: as a projection of near_m to far_m has it, 0 is near and 1 is far.
struct DepthRange {
  double near_m = 0.01, far_m = 100;
};
/// Half as many pixels on each axis, of each 2 x 2 the nearest one: what reprojection must not tear apart is in front.
/// above, below: two rows of 2 x pixels depths, metres; infinity: nothing.
void to_half_depth(const float* above, const float* below, const DepthRange& range, size_t pixels, float* out);
/// The same as shares of 65535.
void to_half_depth(const float* above, const float* below, const DepthRange& range, size_t pixels, uint16_t* out);

/// The context of the session must be current in all calls. Used by one thread.
class PictureChain {
 public:
  /// usage: XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT or ..._DEPTH_STENCIL_ATTACHMENT_BIT. Error: what failed.
  static Result<PictureChain> make(const XrSystem& system, XrSession session, int64_t format,
                                   XrSwapchainUsageFlags usage, int width, int height);
  ~PictureChain();
  PictureChain(PictureChain&& other) noexcept;
  PictureChain& operator=(PictureChain&&) = delete;

  /// Puts one picture, of the chain's size, into the next texture: rows from the upper left; colours are 0x00RRGGBB.
  Status put_colour(const image::View& picture);
  /// The same of its depth; the chain has half of the picture's width and height.
  Status put_depth(const image::View& picture, const DepthRange& range);
  /// What a layer shows: all of the picture that was put last.
  XrSwapchainSubImage sub_image() const;

 private:
  PictureChain(const XrSystem& system, XrSwapchain handle, int64_t format, int width, int height)
      : system_(&system), handle_(handle), format_(format), width_(width), height_(height) {}
  template <class T, class Row>
  void turn(std::vector<T>& turned, Row row);
  template <class Upload>
  Status put_with(Upload upload);

  const XrSystem* system_;
  XrSwapchain handle_;
  int64_t format_;
  int width_, height_;
  std::vector<uint32_t> textures_;
  // OpenGL's textures begin with the lowest row.
  std::vector<uint32_t> turned_;
  std::vector<float> turned_depth_;
  std::vector<uint16_t> turned_depth16_;
};

}  // namespace telesplat::viewer
