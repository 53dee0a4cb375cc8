// Splatting by OpenGL points. The pixels are the CPU splatter's, except for ties in depth and rounding of divisions.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "client/viewer/render/gl/frame_targets.h"
#include "client/viewer/render/renderer.h"
#include "common/core/log.h"
#include "common/gl/egl_context.h"

namespace telesplat::viewer {

/// Features that a context may offer and that need not be used. The defaults are best; tests try the others.
struct GlOptions {
  bool persistent = true;            ///< buffers that stay mapped, where there are any
  std::optional<bool> pack_buffers;  ///< reading back through them: unless the renderer is software
};

class GlRenderer final : public Renderer {
 public:
  /// With a context of its own, off-screen, which is current during its calls only.
  static Result<std::unique_ptr<GlRenderer>> make(const GlOptions& options = {});
  /// In the context that is current in this thread (a window's). There must be one, and it must be current at each call
  /// and when the renderer is destroyed. Fails where it is older than OpenGL 4.3. Between calls the context may be used
  /// for anything: the renderer sets all state that it needs. It leaves no program, vertex array or frame buffer bound,
  /// and blending and depth test off.
  static Result<std::unique_ptr<GlRenderer>> make_in_current_context(const GlOptions& options = {});
  ~GlRenderer() override;

  const char* name() const override { return "gl"; }
  using Renderer::render;
  /// points_drawn counts every point sent: only the GPU knows which of them reach the screen. project_ms: preparing
  /// (processor) and splatting. resolve_ms: shading, reading back and waiting. The GPU's own clock times its stages;
  /// without one, project_ms is all of drawing.
  splat::SplatStats render(const splat::DrawList& list, const geometry::Camera& camera,
                           const splat::RenderOptions& options, const image::Shading& shading,
                           const splat::FrameTarget& target) override;
  /// The same frame, left on the GPU: see last_frame(). Does not wait for it, so the times are those of the newest
  /// frame that the GPU has timed. Fails, with an empty last_frame(), where the GPU cannot hold such a frame.
  Result<splat::SplatStats> render_on_gpu(const splat::DrawList& list, const geometry::Camera& camera,
                                          const splat::RenderOptions& options, const image::Shading& shading,
                                          bool with_depth = false);
  /// The frame that render() or render_on_gpu() made last; empty (width 0) before the first.
  const GlFrame& last_frame() const { return frame_; }

  const std::string& device() const override { return device_; }
  bool is_software() const { return gl::is_software(device_); }

 private:
  enum Stage { kSplatting, kResolving, kFilling, kSmoothing, kAntialiasing, kStages };
  struct Parts;  // what lives in the context
  GlRenderer(std::unique_ptr<gl::EglContext> context, std::unique_ptr<Parts> parts, std::string device);
  static Result<std::unique_ptr<Parts>> make_parts(const GlOptions& options);
  using Current = std::unique_ptr<gl::EglContext::Current>;
  Current use_context() const;
  Status draw(const splat::DrawList& list, const geometry::Camera& camera, const splat::RenderOptions& options,
              const image::Shading& shading, bool with_depth);
  void shade_and_finish(const splat::RenderOptions& options, bool with_depth);
  void release_state() const;
  splat::SplatStats stats(const splat::DrawList& list, bool wait);

  std::unique_ptr<gl::EglContext> context_;  // null: the context belongs to the caller
  std::unique_ptr<Parts> parts_;
  std::string device_;
  GlFrame frame_;
  double prepare_ms_ = 0;
  log::RateLimiter refusals_;
};

}  // namespace telesplat::viewer
