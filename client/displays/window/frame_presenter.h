// Brings finished frames from host memory onto a window, with OpenGL.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>

#include "client/displays/window/overlay.h"
#include "common/core/result.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// A texture that takes each frame, and a triangle that covers the window. Frames go through a ring of persistently
/// mapped pixel buffers where the context has buffer storage (OpenGL 4.4), so that copying one does not wait for the
/// one before to be read; elsewhere glTexSubImage2D copies. All calls with the same context current, OpenGL 3.3 core or
/// later.
class FramePresenter {
 public:
  static Result<std::unique_ptr<FramePresenter>> make();
  ~FramePresenter();
  FramePresenter(const FramePresenter&) = delete;
  FramePresenter& operator=(const FramePresenter&) = delete;

  /// Draws the frame over the whole default framebuffer of width x height pixels; scales it if it has another size.
  /// What lies over it is blended on.
  /// hidden: so many columns at the left will be covered by something else and are left out; overlays lie beside them.
  void draw(const image::View& view, int width, int height, const Overlays& overlays, int hidden = 0);
  /// From now on frames are two eyes' pictures side by side, and each goes into a buffer of its own. Precondition: the
  /// context has them (GL_STEREO).
  void draw_two_eyes() { two_eyes_ = true; }
  bool has_pixel_ring() const { return has_ring_; }

 private:
  static constexpr int kRing = 3;
  FramePresenter() = default;
  void resize(int width, int height);
  void upload(const image::View& view);
  void draw_overlays(const Overlays& overlays, int width, int height, int hidden);
  void draw_part(float begin, float share, int width, int height, const Overlays& overlays, int hidden);
  void load_overlays(const Overlays& overlays);

  bool has_ring_ = false;
  int width_ = 0, height_ = 0, slot_ = 0;
  uint32_t program_ = 0, vertex_array_ = 0, texture_ = 0;
  int keeps_alpha_ = -1, part_ = -1;  // uniforms
  bool two_eyes_ = false;
  std::map<std::string, uint32_t> overlay_textures_;
  uint64_t overlay_version_ = 0;
  struct Slot {
    uint32_t buffer = 0;
    void* memory = nullptr;
    void* fence = nullptr;  // a GLsync: the copy out of this buffer is done
  };
  std::array<Slot, kRing> ring_{};
};

}  // namespace telesplat::viewer
