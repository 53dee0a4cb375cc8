#include "client/viewer/render/slices/renderer.h"

#include "client/viewer/render/slices/gl_renderer.h"
#include "common/core/log.h"

namespace telesplat::viewer {

Result<std::unique_ptr<VolumeRenderer>> make_gl_volume_renderer() {
  auto made = VolumeGlRenderer::make();
  if (!made) return made.error();
  return std::unique_ptr<VolumeRenderer>(std::move(*made));
}

Result<std::unique_ptr<VolumeRenderer>> make_volume_renderer(const std::string& kind, int threads) {
  if (kind == "cpu") return make_cpu_volume_renderer(threads);
  if (kind == "gl") return make_gl_volume_renderer();
  if (kind != "auto") return Error{"renderer is \"" + kind + "\" instead of auto, cpu or gl"};
  auto gl = VolumeGlRenderer::make();
  if (gl && !(*gl)->is_software()) return std::unique_ptr<VolumeRenderer>(std::move(*gl));
  log::debug("no hardware GL ({}): warping on the CPU", gl ? (*gl)->device() : gl.error().text);
  return make_cpu_volume_renderer(threads);
}

}  // namespace telesplat::viewer
