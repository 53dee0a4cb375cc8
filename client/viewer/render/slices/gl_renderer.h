// Warps by OpenGL: each pixel of the display looks through the layers, which lie in one array texture. The pixels are
// the CPU's, except for rounding.
#pragma once

#include <memory>
#include <string>

#include "client/viewer/render/renderer.h"
#include "common/core/log.h"
#include "common/gl/egl_context.h"

namespace telesplat::viewer {

class VolumeGlRenderer final : public VolumeRenderer {
 public:
  /// Makes an off-screen context of its own, current only during calls.
  static Result<std::unique_ptr<VolumeGlRenderer>> make();
  ~VolumeGlRenderer() override;

  const char* name() const override { return "gl"; }
  /// A frame's layers are uploaded when it is first drawn: ids, epochs and addresses tell frames apart. warp_cpu_ms is
  /// the calling thread's time, waiting included. samples counts all layers in all pixels, although a far eye needs
  /// few of them. A frame that the GPU cannot hold is drawn as the background only, and logged.
  volume::WarpStats render(const volume::VolumeFrame* frame, const geometry::Camera& camera, uint32_t background,
                           const volume::WarpTarget& target) override;

  const std::string& device() const { return context_->renderer(); }
  bool is_software() const { return context_->software(); }

 private:
  struct Parts;  // objects that live in the context
  VolumeGlRenderer(std::unique_ptr<gl::EglContext> context, std::unique_ptr<Parts> parts);

  std::unique_ptr<gl::EglContext> context_;
  std::unique_ptr<Parts> parts_;
  log::RateLimiter refusals_;
};

}  // namespace telesplat::viewer
