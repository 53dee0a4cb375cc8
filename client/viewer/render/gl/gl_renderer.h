// Splatting by OpenGL points. The same pixels as the CPU splatter's, but for ties in depth and rounding of divisions.
#pragma once

#include <memory>
#include <vector>

#include "client/viewer/render/gl/point_arena.h"
#include "client/viewer/render/gl/program.h"
#include "client/viewer/render/renderer.h"
#include "common/core/log.h"
#include "common/gl/egl_context.h"
#include "common/splat/item_runs.h"

namespace telesplat::viewer {

class GlRenderer final : public Renderer {
 public:
  static Result<std::unique_ptr<GlRenderer>> make();
  ~GlRenderer() override;

  const char* name() const override { return "gl"; }
  using Renderer::render;
  /// points_drawn counts every point sent: which of them reach the screen only the GPU knows. project_ms is what drawing and resolve_ms
  /// what reading back took.
  splat::SplatStats render(const splat::DrawList& list, const geometry::Camera& camera, const splat::RenderOptions& options,
                           const image::Shading& shading, const splat::FrameTarget& target) override;

  const std::string& device() const { return context_->renderer(); }
  bool is_software() const { return context_->software(); }

 private:
  using Current = gl::EglContext::Current;
  GlRenderer(std::unique_ptr<gl::EglContext> context, std::unique_ptr<Current> current, const SplatProgram& program);
  Status resize(int width, int height);
  void prepare_draws(const splat::DrawList& list, const geometry::Camera& camera, splat::Kernel kernel);
  void draw(const geometry::Camera& camera, const image::Shading& shading, bool with_depth);
  void read_back(const splat::FrameTarget& target) const;

  struct DrawCommand {
    uint32_t count, instances, first, base_instance;
  };

  std::unique_ptr<gl::EglContext> context_;  // first in, last out: the rest needs it
  std::unique_ptr<Current> current_;         // in the thread that made the renderer, as long as it lives
  SplatProgram program_;
  std::unique_ptr<PointArenas> arenas_;
  int width_ = 0, height_ = 0;                   // of the frame buffer, without its margin
  uint32_t framebuffer_ = 0, textures_[3] = {};  // colour, depth in metres, depth
  uint32_t vertex_array_ = 0, draw_numbers_ = 0, draw_records_ = 0, commands_ = 0, intensities_ = 0;
  size_t draw_number_count_ = 0;
  log::RateLimiter refusals_;
  splat::ItemRuns runs_;
  std::vector<DrawRecord> records_;
  std::vector<std::vector<DrawCommand>> commands_by_arena_;
};

}  // namespace telesplat::viewer
