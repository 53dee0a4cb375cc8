#include <cmath>

#include "client/viewer/render/renderer.h"
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

}  // namespace

std::unique_ptr<Renderer> make_cpu_renderer(int threads) { return std::make_unique<CpuRenderer>(threads); }

}  // namespace telesplat::viewer
