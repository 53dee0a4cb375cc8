// The one interface of both renderers of volumes: the warp of slice images into the view of now.
#pragma once

#include <memory>
#include <string>

#include "client/viewer/render/renderer_trial.h"
#include "common/core/result.h"
#include "common/volume/warp/warper.h"

namespace telesplat::viewer {

class VolumeRenderer {
 public:
  virtual ~VolumeRenderer() = default;
  /// "cpu" or "gl"; "auto": both are still timed.
  virtual const char* name() const = 0;
  /// As volume::Warper::render. Called from one thread, the one that made the renderer.
  virtual volume::WarpStats render(const volume::VolumeFrame* frame, const geometry::Camera& camera,
                                   uint32_t background, const volume::WarpTarget& target) = 0;
};

std::unique_ptr<VolumeRenderer> make_cpu_volume_renderer(int threads);
/// EGL, off-screen. Fails with what was tried.
Result<std::unique_ptr<VolumeRenderer>> make_gl_volume_renderer();
/// kind: "auto" (the quicker one where there is a hardware GPU, else cpu), "cpu", "gl".
Result<std::unique_ptr<VolumeRenderer>> make_volume_renderer(
    const std::string& kind, int threads,
    const std::shared_ptr<RendererChoice>& choice = std::make_shared<RendererChoice>());

}  // namespace telesplat::viewer
