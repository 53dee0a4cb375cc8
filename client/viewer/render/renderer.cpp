#include "client/viewer/render/renderer.h"

#include "client/viewer/render/gl/gl_renderer.h"
#include "common/core/log.h"

namespace telesplat::viewer {

splat::SplatStats Renderer::render_pair(const splat::DrawList& list, const std::array<geometry::Camera, 2>& cameras,
                                        const splat::RenderOptions& options, const image::Shading& shading,
                                        const std::array<splat::FrameTarget, 2>& targets) {
  splat::SplatStats sum;
  for (size_t i = 0; i < cameras.size(); ++i) {
    const splat::SplatStats one = render(list, cameras[i], options, shading, targets[i]);
    sum.points_projected += one.points_projected;
    sum.points_drawn += one.points_drawn;
    sum.prepare_ms += one.prepare_ms;
    sum.project_ms += one.project_ms;
    sum.resolve_ms += one.resolve_ms;
    sum.fill_ms += one.fill_ms;
    sum.smooth_ms += one.smooth_ms;
    sum.antialias_ms += one.antialias_ms;
  }
  return sum;
}

Result<std::unique_ptr<Renderer>> make_gl_renderer() {
  auto made = GlRenderer::make();
  if (!made) return made.error();
  return std::unique_ptr<Renderer>(std::move(*made));
}

Result<std::unique_ptr<Renderer>> make_renderer(const std::string& kind, int threads) {
  if (kind == "cpu") return make_cpu_renderer(threads);
  if (kind == "gl") return make_gl_renderer();
  if (kind != "auto") return Error{"renderer is \"" + kind + "\" instead of auto, cpu or gl"};
  auto gl = GlRenderer::make();
  if (gl && !(*gl)->is_software()) return std::unique_ptr<Renderer>(std::move(*gl));
  log::debug("no hardware GL ({}): splatting on the CPU", gl ? (*gl)->device() : gl.error().text);
  return make_cpu_renderer(threads);
}

}  // namespace telesplat::viewer
