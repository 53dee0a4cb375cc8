#include "client/viewer/render/slices/renderer.h"

namespace telesplat::viewer {
namespace {

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

}  // namespace

std::unique_ptr<VolumeRenderer> make_cpu_volume_renderer(int threads) {
  return std::make_unique<CpuVolumeRenderer>(threads);
}

}  // namespace telesplat::viewer
