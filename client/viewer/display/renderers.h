// Makes renderers for a display's sources when a source needs one, on the CPU or with OpenGL.
#pragma once

#include <memory>
#include <string>

#include "client/viewer/render/renderer.h"

namespace telesplat::viewer {

/// Used by one thread, the display's. A renderer's context must be gone before another renderer is made: sources are
/// destroyed first.
class Renderers {
 public:
  /// kind: "auto" (the quicker one if there is a hardware GPU, else cpu), "cpu", "gl". Makes the first renderer of
  /// points at once, so that failures are known before the session begins. Error: names what was tried.
  static Result<Renderers> make(const std::string& kind, int threads);

  /// Name of the renderer of points: "cpu" or "gl"; "auto": both are timed on the session's first frames.
  const char* name() const { return name_; }
  /// OpenGL's name for the device that draws; empty: the processor draws.
  const std::string& device() const { return device_; }
  /// The renderer that is kept after that, and the reason.
  std::shared_ptr<const RendererChoice> choice() const { return choice_; }
  Result<std::unique_ptr<Renderer>> for_points();
  Result<std::unique_ptr<VolumeRenderer>> for_slices();

 private:
  Renderers(std::string kind, int threads, std::unique_ptr<Renderer> first, std::shared_ptr<RendererChoice> choice);

  std::string kind_;
  int threads_;
  const char* name_;
  std::string device_;
  std::unique_ptr<Renderer> first_;  // until a source needs one
  std::shared_ptr<RendererChoice> choice_;
};

}  // namespace telesplat::viewer
