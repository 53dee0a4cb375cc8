#include "client/viewer/render/renderer.h"

#include <cmath>

#include "client/viewer/render/gl/gl_renderer.h"
#include "client/viewer/render/slices/gl_renderer.h"
#include "common/core/log.h"
#include "common/core/machine.h"

namespace telesplat::viewer {
namespace {

constexpr double kSameFocal = 1e-6;

class CpuRenderer final : public Renderer {
 public:
  explicit CpuRenderer(int threads) : splatter_(threads), threads_(threads > 0 ? threads : usable_processors()) {}
  const char* name() const override { return "cpu"; }
  int threads() const override { return threads_; }
  bool halves() const override { return true; }
  splat::SplatStats render(const splat::DrawList& list, const geometry::Camera& camera,
                           const splat::RenderOptions& options, const image::Shading& shading,
                           const splat::FrameTarget& target) override {
    return splatter_.render(list, camera, options, shading, target);
  }
  splat::SplatStats render_pair(const splat::DrawList& list, const std::array<geometry::Camera, 2>& cameras,
                                const splat::RenderOptions& options, const image::Shading& shading,
                                const std::array<splat::FrameTarget, 2>& targets) override {
    // Before a wall's screen one eye may be nearer than the other.
    if (std::abs(cameras[0].focal_x() / cameras[1].focal_x() - 1) > kSameFocal)
      return Renderer::render_pair(list, cameras, options, shading, targets);
    return splatter_.render_pair(list, cameras, options, shading, targets);
  }

 private:
  splat::CpuSplatter splatter_;
  int threads_;
};

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

class CpuVolumeRenderer final : public VolumeRenderer {
 public:
  explicit CpuVolumeRenderer(int threads) : warper_(threads) {}
  const char* name() const override { return "cpu"; }
  volume::WarpStats render(const volume::VolumeFrame* frame, const geometry::Camera& camera, uint32_t background,
                           const volume::WarpTarget& target) override {
    return warper_.render(frame, camera, background, target);
  }

 private:
  volume::Warper warper_;
};

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

// Gl: the class of the OpenGL renderer. what: the work that is done, for the log.
template <class Gl, class R>
Result<std::unique_ptr<R>> choose(const std::string& kind, int threads, std::unique_ptr<R> (*make_cpu)(int threads),
                                  const std::function<std::unique_ptr<R>(std::unique_ptr<R>, std::unique_ptr<R>)>& both,
                                  RendererChoice& choice, const char* what) {
  if (kind != "auto" && kind != "cpu" && kind != "gl")
    return Error{"renderer is \"" + kind + "\" instead of auto, cpu or gl"};
  if (kind != "gl") choice.set({"cpu"});
  if (kind == "cpu") return make_cpu(threads);
  auto gl = Gl::make();
  if (kind == "gl") {
    if (!gl) return gl.error();
    choice.set({"gl"});
    return std::unique_ptr<R>(std::move(*gl));
  }
  if (gl && !(*gl)->is_software()) {
    choice.set({});
    return both(make_cpu(threads), std::move(*gl));
  }
  log::debug("no hardware GL ({}): {} on the CPU", gl ? (*gl)->device() : gl.error().text, what);
  return make_cpu(threads);
}

}  // namespace

splat::SplatStats Renderer::render_pair(const splat::DrawList& list, const std::array<geometry::Camera, 2>& cameras,
                                        const splat::RenderOptions& options, const image::Shading& shading,
                                        const std::array<splat::FrameTarget, 2>& targets) {
  splat::SplatStats sum;
  for (size_t i = 0; i < cameras.size(); ++i) sum += render(list, cameras[i], options, shading, targets[i]);
  return sum;
}

std::unique_ptr<Renderer> make_cpu_renderer(int threads) { return std::make_unique<CpuRenderer>(threads); }

std::unique_ptr<Renderer> try_renderers(std::unique_ptr<Renderer> cpu, std::unique_ptr<Renderer> gl,
                                        std::shared_ptr<RendererChoice> choice, std::function<double()> now_s) {
  return std::make_unique<TriedRenderer>(std::move(cpu), std::move(gl), std::move(choice), std::move(now_s));
}

Result<std::unique_ptr<Renderer>> make_renderer(const std::string& kind, int threads,
                                                const std::shared_ptr<RendererChoice>& choice) {
  const auto both = [&](auto cpu, auto gl) { return try_renderers(std::move(cpu), std::move(gl), choice); };
  return choose<GlRenderer, Renderer>(kind, threads, make_cpu_renderer, both, *choice, "splatting");
}

std::unique_ptr<VolumeRenderer> make_cpu_volume_renderer(int threads) {
  return std::make_unique<CpuVolumeRenderer>(threads);
}

Result<std::unique_ptr<VolumeRenderer>> make_volume_renderer(const std::string& kind, int threads,
                                                             const std::shared_ptr<RendererChoice>& choice) {
  const auto both = [&](auto cpu, auto gl) {
    return std::make_unique<TriedVolumeRenderer>(std::move(cpu), std::move(gl), choice);
  };
  return choose<VolumeGlRenderer, VolumeRenderer>(kind, threads, make_cpu_volume_renderer, both, *choice, "warping");
}

}  // namespace telesplat::viewer
