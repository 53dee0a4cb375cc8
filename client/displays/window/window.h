// A window with an OpenGL context, through GLFW, and the person's keys and mouse. All calls from the main thread.
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
    int width = 1280, height = 800;  ///< of the content, in screen coordinates; ignored if fullscreen
    bool fullscreen = false;
    std::string title = "Telesplat";
    bool two_eyes = false;  ///< frames are two eyes' pictures, side by side, for a buffer each (quad-buffered OpenGL)
  };
  /// One at a time in a process. The context is OpenGL 4.3 core, or 3.3 where that is not to be had. Nothing is left
  /// current.
  static Result<std::unique_ptr<Window>> open(const Options& options);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Its context, current in this thread for a scope; then what was current before, also where that is of another API
  /// (a renderer's own context).
  class Current {
   public:
    explicit Current(const Window& window);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    void *display_, *context_, *draw_, *read_;  // EGL's; nothing to go back to: the context stays
  };

  /// Delivers keys, mouse and wheel since the last call; catches the pointer while the person flies.
  void poll(Interaction& interaction);
  /// The person closed it, or it is lost.
  bool closing() const;
  /// The connection to the window system broke: nothing is shown any more, and nothing of it can be freed.
  bool lost() const;
  /// Pixels of the content, 16 at least, which on fine screens are more than screen coordinates; the last ones while it
  /// is minimised.
  int width() const { return width_; }
  int height() const { return height_; }
  void set_title(const std::string& title);
  /// Fills the screen that it lies on for the most part, or becomes the window again that it was.
  void toggle_fullscreen();
  /// Seconds between refreshes of that screen; 0: it does not tell.
  double refresh_s();
  bool fullscreen() const;
  /// What is printed on a key of this keyboard.
  std::string key_name(Key key) const;
  /// How much larger than on a plain display texts should be, in pixels: 2 on one of twice the density.
  double content_scale() const;
  /// Files that were dropped onto the window since the last call.
  std::vector<std::string> take_dropped();
  /// Shows a frame and what lies over it, in time with the screen; nothing happens while the window is minimised. gui:
  /// builds what lies over all (Gui::prepare()); null: nothing.
  void present(const image::View& view, const Overlays& overlays, const std::function<double()>& gui = {});
  /// How many columns of pixels at the left of what was presented nothing shines through.
  int hidden() const;
  /// Whether what `gui` builds has changed since it was presented.
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
