// Interfaces of both display renderers of points, and of both renderers of volumes, which warp slice images into the
// present view.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "client/viewer/render/renderer_trial.h"
#include "common/core/result.h"
#include "common/geometry/camera.h"
#include "common/image/file.h"
#include "common/splat/cpu_splatter.h"
#include "common/volume/warp/warper.h"

namespace telesplat::viewer {

class Renderer {
 public:
  virtual ~Renderer() = default;
  /// "cpu" or "gl"; "auto": both are still timed.
  virtual const char* name() const = 0;
  /// Number of threads over which stage times are summed.
  virtual int threads() const { return 1; }
  /// OpenGL's name for the device that draws; empty: it does not draw by OpenGL.
  virtual const std::string& device() const {
    static const std::string none;
    return none;
  }
  /// True if it draws halved frames faster (splat::RenderOptions::halved); else it ignores that option.
  virtual bool halves() const { return false; }
  /// Draws one frame into target (host memory). Called only from the thread that made the renderer.
  virtual splat::SplatStats render(const splat::DrawList& list, const geometry::Camera& camera,
                                   const splat::RenderOptions& options, const image::Shading& shading,
                                   const splat::FrameTarget& target) = 0;
  /// Draws two views of one list (CpuSplatter::render_pair). Counts and times are sums over both, points_drawn too.
  virtual splat::SplatStats render_pair(const splat::DrawList& list, const std::array<geometry::Camera, 2>& cameras,
                                        const splat::RenderOptions& options, const image::Shading& shading,
                                        const std::array<splat::FrameTarget, 2>& targets);
  /// Draws without any finish.
  splat::SplatStats render(const splat::DrawList& list, const geometry::Camera& camera, splat::Kernel kernel,
                           const image::Shading& shading, const splat::FrameTarget& target) {
    return render(list, camera, splat::RenderOptions{kernel, {false, false, false}}, shading, target);
  }
};

std::unique_ptr<Renderer> make_cpu_renderer(int threads);
/// Draws with both by turns until `choice` has the one that is kept.
std::unique_ptr<Renderer> try_renderers(std::unique_ptr<Renderer> cpu, std::unique_ptr<Renderer> gl,
                                        std::shared_ptr<RendererChoice> choice,
                                        std::function<double()> now_s = monotonic_s);
/// kind: "auto" (the quicker one if there is a hardware GPU, else cpu), "cpu", "gl": EGL, off-screen (device or Mesa
/// surfaceless platform), OpenGL 4.3 or later. Error: names what was tried.
Result<std::unique_ptr<Renderer>> make_renderer(
    const std::string& kind, int threads,
    const std::shared_ptr<RendererChoice>& choice = std::make_shared<RendererChoice>());

/// Interface of both renderers of volumes, which warp slice images into the present view.
class VolumeRenderer {
 public:
  virtual ~VolumeRenderer() = default;
  /// "cpu" or "gl"; "auto": both are still timed.
  virtual const char* name() const = 0;
  /// As volume::Warper::render. Called only from the thread that made the renderer.
  virtual volume::WarpStats render(const volume::VolumeFrame* frame, const geometry::Camera& camera,
                                   uint32_t background, const volume::WarpTarget& target) = 0;
};

std::unique_ptr<VolumeRenderer> make_cpu_volume_renderer(int threads);
/// As make_renderer().
Result<std::unique_ptr<VolumeRenderer>> make_volume_renderer(
    const std::string& kind, int threads,
    const std::shared_ptr<RendererChoice>& choice = std::make_shared<RendererChoice>());

/// Makes room for a frame of this camera, with depth or without. Old content becomes void.
inline void fit(image::View& view, const geometry::Camera& camera, bool with_depth) {
  const size_t pixels = size_t(camera.width) * size_t(camera.height);
  view.width = camera.width;
  view.height = camera.height;
  view.colour.resize(pixels);
  view.depth_m.resize(with_depth ? pixels : 0);
}

}  // namespace telesplat::viewer
