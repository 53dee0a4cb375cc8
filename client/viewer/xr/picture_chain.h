// The textures that an eye's pictures go into.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "client/viewer/xr/xr_system.h"

namespace telesplat::viewer {

/// The context of the session must be current in all calls. Used by one thread.
class PictureChain {
 public:
  /// usage: XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT or ..._DEPTH_STENCIL_ATTACHMENT_BIT. Error: what failed.
  static Result<PictureChain> make(const XrSystem& system, XrSession session, int64_t format,
                                   XrSwapchainUsageFlags usage, int width, int height);
  ~PictureChain();
  PictureChain(PictureChain&& other) noexcept;
  PictureChain& operator=(PictureChain&&) = delete;

  /// Puts one picture into the next texture: rows from the upper left; colours are 0x00RRGGBB.
  Status put(std::span<const uint32_t> colour);
  /// The same of depth, 0 to 1.
  Status put(std::span<const float> depth);
  /// What a layer shows: all of the picture that was put last.
  XrSwapchainSubImage sub_image() const;

 private:
  PictureChain(const XrSystem& system, XrSwapchain handle, int width, int height)
      : system_(&system), handle_(handle), width_(width), height_(height) {}
  template <class Upload>
  Status put_with(Upload upload);

  const XrSystem* system_;
  XrSwapchain handle_;
  int width_, height_;
  std::vector<uint32_t> textures_;
  std::vector<uint32_t> turned_;  // OpenGL's textures begin with the lowest row
};

}  // namespace telesplat::viewer
