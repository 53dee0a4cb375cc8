#include "client/viewer/render/renderer.h"

#include "client/viewer/render/gl/gl_renderer.h"
#include "common/core/log.h"

namespace telesplat::viewer {

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
