// The textures for an eye's pictures.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "client/displays/xr/xr_system.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// Converts 0xAARRGGBB to bytes R G B A.
void to_rgba(const uint32_t* colour, size_t pixels, uint32_t* out);

/// Depth of a headset's layers: as a projection of near_m to far_m gives it, 0 is near and 1 is far.
struct DepthRange {
  double near_m = 0.01, far_m = 100;
};
/// Halves the pixels on each axis; each 2 x 2 becomes the nearest of them: reprojection must not tear what is in front.
/// above, below: two rows of 2 x pixels depths, metres; infinity: empty.
void to_half_depth(const float* above, const float* below, const DepthRange& range, size_t pixels, float* out);
/// Does the same in units of 1 / 65535.
void to_half_depth(const float* above, const float* below, const DepthRange& range, size_t pixels, uint16_t* out);

/// Used by one thread; the session's context must be current there in all calls.
class PictureChain {
 public:
  /// usage: XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT or ..._DEPTH_STENCIL_ATTACHMENT_BIT. Error: the call that failed.
  static Result<PictureChain> make(const XrSystem& system, XrSession session, int64_t format,
                                   XrSwapchainUsageFlags usage, int width, int height);
  ~PictureChain();
  PictureChain(PictureChain&& other) noexcept;
  PictureChain& operator=(PictureChain&&) = delete;

  /// Puts one picture of the chain's size into the next texture: rows from the upper left; colours are 0x00RRGGBB.
  Status put_colour(const image::View& picture);
  /// Does the same with its depth; the chain has half of the picture's width and height.
  Status put_depth(const image::View& picture, const DepthRange& range);
  /// The whole of the newest picture, for a layer.
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
  // Rows in OpenGL's order, lowest first.
  std::vector<uint32_t> turned_;
  std::vector<float> turned_depth_;
  std::vector<uint16_t> turned_depth16_;
};

}  // namespace telesplat::viewer
