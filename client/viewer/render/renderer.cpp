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

namespace {

class TriedRenderer final : public Renderer {
 public:
  TriedRenderer(std::unique_ptr<Renderer> cpu, std::unique_ptr<Renderer> gl, std::shared_ptr<RendererChoice> choice,
                std::function<double()> now_s)
      : device_(gl->device()), tried_(std::move(cpu), std::move(gl), std::move(choice), std::move(now_s)) {}

  const char* name() const override { return tried_.kept() ? tried_.kept()->name() : "auto"; }
  const std::string& device() const override { return device_; }
  int threads() const override { return tried_.next().threads(); }
  bool halves() const override { return tried_.kept() && tried_.kept()->halves(); }
  splat::SplatStats render(const splat::DrawList& list, const geometry::Camera& camera,
                           const splat::RenderOptions& options, const image::Shading& shading,
                           const splat::FrameTarget& target) override {
    return tried_.draw(size_of(list, target),
                       [&](Renderer& r) { return r.render(list, camera, options, shading, target); });
  }
  splat::SplatStats render_pair(const splat::DrawList& list, const std::array<geometry::Camera, 2>& cameras,
                                const splat::RenderOptions& options, const image::Shading& shading,
                                const std::array<splat::FrameTarget, 2>& targets) override {
    return tried_.draw(size_of(list, targets[0]),
                       [&](Renderer& r) { return r.render_pair(list, cameras, options, shading, targets); });
  }

 private:
  static size_t size_of(const splat::DrawList& list, const splat::FrameTarget& target) {
    return list.points > 0 ? size_t(target.width) * size_t(target.height) : 0;
  }

  std::string device_;
  TriedRenderers<Renderer> tried_;
};

}  // namespace

std::unique_ptr<Renderer> try_renderers(std::unique_ptr<Renderer> cpu, std::unique_ptr<Renderer> gl,
                                        std::shared_ptr<RendererChoice> choice, std::function<double()> now_s) {
  return std::make_unique<TriedRenderer>(std::move(cpu), std::move(gl), std::move(choice), std::move(now_s));
}

Result<std::unique_ptr<Renderer>> make_renderer(const std::string& kind, int threads,
                                                const std::shared_ptr<RendererChoice>& choice) {
  if (kind != "auto" && kind != "cpu" && kind != "gl")
    return Error{"renderer is \"" + kind + "\" instead of auto, cpu or gl"};
  if (kind != "gl") choice->set({"cpu"});
  if (kind == "cpu") return make_cpu_renderer(threads);
  auto gl = GlRenderer::make();
  if (kind == "gl") {
    if (!gl) return gl.error();
    choice->set({"gl"});
    return std::unique_ptr<Renderer>(std::move(*gl));
  }
  if (gl && !(*gl)->is_software()) {
    choice->set({});
    return try_renderers(make_cpu_renderer(threads), std::move(*gl), choice);
  }
  log::debug("no hardware GL ({}): splatting on the CPU", gl ? (*gl)->device() : gl.error().text);
  return make_cpu_renderer(threads);
}

}  // namespace telesplat::viewer
