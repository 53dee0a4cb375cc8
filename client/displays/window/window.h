// A window with an OpenGL context, through GLFW, and the person's keys and mouse. All calls come from the main thread.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/displays/window/input/interaction.h"
#include "client/displays/window/overlay.h"
#include "client/displays/window/panel/gui/gui.h"
#include "common/core/result.h"
#include "common/image/file.h"

namespace telesplat::viewer {

class Window {
 public:
  struct Options {
    int width = 1280, height = 800;  ///< size of the content, in screen coordinates; ignored if fullscreen
    bool fullscreen = false;
    std::string title = "Telesplat";
    bool two_eyes = false;  ///< frames are two eyes' pictures, side by side, one for each buffer (quad-buffered OpenGL)
  };
  /// Opens a window; one at a time in a process. The context is OpenGL 4.3 core, or 3.3 if that is not available. No
  /// context is left current.
  static Result<std::unique_ptr<Window>> open(const Options& options);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Makes the window's context current in this thread for a scope; then the one before becomes current again, even if
  /// it belongs to another API (a renderer's own context).
  class Current {
   public:
    explicit Current(const Window& window);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    void *display_, *context_, *draw_, *read_;  // contexts of EGL; null: the window's context stays current
  };

  /// Delivers keys, mouse and wheel since the last call; catches the pointer while the person flies.
  void poll(Interaction& interaction);
  /// True if the person closed it, or it is lost.
  bool closing() const;
  /// True if the connection to the window system broke: it shows nothing any more, and nothing of it can be freed.
  bool lost() const;
  /// Pixels of the content, at least 16 a side; on fine screens more than screen coordinates. While the window is
  /// minimised they keep their values.
  int width() const { return width_; }
  int height() const { return height_; }
  void set_title(const std::string& title);
  /// Fills the screen that it mostly lies on, or becomes the window again that it was.
  void toggle_fullscreen();
  /// Seconds between refreshes of that screen; 0: not known.
  double refresh_s();
  bool fullscreen() const;
  /// Returns the print on a key of this keyboard.
  std::string key_name(Key key) const;
  /// Size of texts relative to a plain display, in pixels: 2 for twice the density.
  double content_scale() const;
  /// Returns files that were dropped onto the window since the last call.
  std::vector<std::string> take_dropped();
  /// Shows a frame and its overlays, in time with the screen; does nothing while the window is minimised. gui: builds
  /// the layer above all (Gui::prepare()); null: there is no such layer.
  void present(const image::View& view, const Overlays& overlays, const std::function<double()>& gui = {});
  /// Columns of pixels at the left of the last frame that are fully covered.
  int hidden() const;
  /// True if the things that `gui` builds have changed since they were presented.
  bool gui_due(double now_s) const;

 private:
  struct Impl;
  explicit Window(std::unique_ptr<Impl> impl);
  void read_size();

  std::unique_ptr<Impl> impl_;
  int width_ = 0, height_ = 0;
  double refresh_s_ = -1;  // < 0: to be asked for
};

}  // namespace telesplat::viewer
