#include "client/viewer/render/slices/renderer.h"

#include "client/viewer/render/slices/gl_renderer.h"
#include "common/core/log.h"

namespace telesplat::viewer {

Result<std::unique_ptr<VolumeRenderer>> make_gl_volume_renderer() {
  auto made = VolumeGlRenderer::make();
  if (!made) return made.error();
  return std::unique_ptr<VolumeRenderer>(std::move(*made));
}

namespace {

class TriedVolumeRenderer final : public VolumeRenderer {
 public:
  TriedVolumeRenderer(std::unique_ptr<VolumeRenderer> cpu, std::unique_ptr<VolumeRenderer> gl,
                      std::shared_ptr<RendererChoice> choice)
      : tried_(std::move(cpu), std::move(gl), std::move(choice)) {}

  const char* name() const override { return tried_.kept() ? tried_.kept()->name() : "auto"; }
  volume::WarpStats render(const volume::VolumeFrame* frame, const geometry::Camera& camera, uint32_t background,
                           const volume::WarpTarget& target) override {
    const size_t pixels = frame ? size_t(target.width) * size_t(target.height) : 0;
    return tried_.draw(pixels, [&](VolumeRenderer& r) { return r.render(frame, camera, background, target); });
  }

 private:
  TriedRenderers<VolumeRenderer> tried_;
};

}  // namespace

Result<std::unique_ptr<VolumeRenderer>> make_volume_renderer(const std::string& kind, int threads,
                                                             const std::shared_ptr<RendererChoice>& choice) {
  if (kind != "auto" && kind != "cpu" && kind != "gl")
    return Error{"renderer is \"" + kind + "\" instead of auto, cpu or gl"};
  if (kind != "gl") choice->set({"cpu"});
  if (kind == "cpu") return make_cpu_volume_renderer(threads);
  auto gl = VolumeGlRenderer::make();
  if (kind == "gl") {
    if (!gl) return gl.error();
    choice->set({"gl"});
    return std::unique_ptr<VolumeRenderer>(std::move(*gl));
  }
  if (gl && !(*gl)->is_software()) {
    choice->set({});
    return std::unique_ptr<VolumeRenderer>(
        std::make_unique<TriedVolumeRenderer>(make_cpu_volume_renderer(threads), std::move(*gl), choice));
  }
  log::debug("no hardware GL ({}): warping on the CPU", gl ? (*gl)->device() : gl.error().text);
  return make_cpu_volume_renderer(threads);
}

}  // namespace telesplat::viewer
