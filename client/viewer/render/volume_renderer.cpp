#include "client/viewer/render/volume_renderer.h"

namespace telesplat::viewer {

Result<std::unique_ptr<VolumeRenderer>> make_gl_volume_renderer() { return Error{"volumes are drawn on the CPU"}; }

Result<std::unique_ptr<VolumeRenderer>> make_volume_renderer(const std::string& kind, int threads) {
  if (kind == "cpu") return make_cpu_volume_renderer(threads);
  if (kind == "gl") return make_gl_volume_renderer();
  if (kind != "auto") return Error{"renderer is \"" + kind + "\" instead of auto, cpu or gl"};
  return make_cpu_volume_renderer(threads);
}

}  // namespace telesplat::viewer
