// Draws finished frames from host memory onto a window, with OpenGL.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "client/displays/window/overlay.h"
#include "client/viewer/render/gl/program.h"
#include "common/core/result.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// A texture that takes each frame, and a triangle that covers the window. All calls need the same current context,
/// OpenGL 3.3 core or later.
class FramePresenter {
 public:
  static Result<std::unique_ptr<FramePresenter>> make();
  ~FramePresenter();
  FramePresenter(const FramePresenter&) = delete;
  FramePresenter& operator=(const FramePresenter&) = delete;

  /// Draws the frame over the whole default framebuffer of width x height pixels; scales it if it has another size.
  /// Overlays are blended onto it.
  /// hidden: columns at the left that will be covered: they are not drawn, and overlays lie beside them.
  void draw(const image::View& view, int width, int height, const Overlays& overlays, int hidden = 0);
  /// From now on frames are two eyes' pictures side by side, and each goes into its own buffer. Precondition: the
  /// context has buffers for two eyes (GL_STEREO).
  void draw_two_eyes() { two_eyes_ = true; }

 private:
  FramePresenter() = default;
  void resize(int width, int height);
  void draw_overlays(const Overlays& overlays, int width, int height, int hidden);
  void draw_part(float begin, float share, int width, int height, const Overlays& overlays, int hidden);
  void load_overlays(const Overlays& overlays);

  int width_ = 0, height_ = 0;
  gl::Program program_;
  uint32_t vertex_array_ = 0, texture_ = 0;
  int keeps_alpha_ = -1, part_ = -1;  // uniforms
  bool two_eyes_ = false;
  std::map<std::string, uint32_t> overlay_textures_;
  uint64_t overlay_version_ = 0;
};

}  // namespace telesplat::viewer
