// Splats by OpenGL points. The pixels are the CPU splatter's, except for ties in depth and rounding of divisions.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "client/viewer/render/gl/frame_targets.h"
#include "client/viewer/render/renderer.h"
#include "common/core/log.h"
#include "common/gl/egl_context.h"

namespace telesplat::viewer {

class GlRenderer final : public Renderer {
 public:
  /// Makes an off-screen context of its own, current only during calls. pack_buffers: read frames back through them;
  /// not given: yes, unless the renderer is software.
  static Result<std::unique_ptr<GlRenderer>> make(std::optional<bool> pack_buffers = {});
  ~GlRenderer() override;

  const char* name() const override { return "gl"; }
  using Renderer::render;
  /// points_drawn counts every point sent: only the GPU knows which ones reach the screen. project_ms: preparing
  /// (processor) and splatting. resolve_ms: shading, reading back and waiting. The GPU's own clock times its stages;
  /// without one, project_ms covers all of drawing.
  splat::SplatStats render(const splat::DrawList& list, const geometry::Camera& camera,
                           const splat::RenderOptions& options, const image::Shading& shading,
                           const splat::FrameTarget& target) override;
  const std::string& device() const override { return device_; }
  bool is_software() const { return gl::is_software(device_); }

 private:
  enum Stage { kSplatting, kResolving, kFilling, kSmoothing, kAntialiasing, kStages };
  struct Parts;  // objects that live in the context
  GlRenderer(std::unique_ptr<gl::EglContext> context, std::unique_ptr<Parts> parts, std::string device);
  static Result<std::unique_ptr<Parts>> make_parts(std::optional<bool> pack_buffers);
  Status draw(const splat::DrawList& list, const geometry::Camera& camera, const splat::RenderOptions& options,
              const image::Shading& shading, bool with_depth);
  void shade_and_finish(const splat::RenderOptions& options, bool with_depth);
  splat::SplatStats stats(const splat::DrawList& list);

  std::unique_ptr<gl::EglContext> context_;
  std::unique_ptr<Parts> parts_;
  std::string device_;
  double prepare_ms_ = 0;
  log::RateLimiter refusals_;
};

}  // namespace telesplat::viewer
