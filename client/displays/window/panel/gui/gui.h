// Dear ImGui in a window of GLFW's: gets its events, draws over its frames.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "common/core/result.h"

struct GLFWwindow;

namespace telesplat::viewer {

/// What is built is drawn into a texture, only when something happened or a tenth of a second is over, and that texture
/// is blended over each frame: so a panel costs little while nobody touches it. One at a time in a process. The
/// window's context is current in make(), prepare(), show() and the destructor. One thread.
class Gui {
 public:
  /// Error: the context's OpenGL cannot draw it.
  static Result<std::unique_ptr<Gui>> make(GLFWwindow* window);
  ~Gui();
  Gui(const Gui&) = delete;
  Gui& operator=(const Gui&) = delete;

  // ---- events, as GLFW's callbacks have them ----
  void on_key(int key, int scancode, int action, int mods);
  void on_character(unsigned code);
  void on_button(int button, int action, int mods);
  void on_wheel(double x, double y);
  void on_focus(bool focused);
  void on_enter(bool entered);
  void on_move();

  /// Whether what happens with the pointer at a place (screen coordinates of the window) is meant for what is drawn.
  bool takes_pointer(double x, double y) const;
  /// Whether keys are meant for a text that is being written.
  bool takes_text() const;
  /// Letters that come from now on are meant for a text, though it does not have the focus yet: they wait for it.
  void expect_text(bool expected);
  /// Closes the list or the colours that an item opened. False: nothing is open.
  bool close_popup();
  /// Whether it has something else to show than before.
  bool due(double now_s) const;

  struct Place {
    int width = 0, height = 0;  ///< of the default framebuffer, pixels
    double content_scale = 1;   ///< of the display; 2 where texts should have twice as many pixels
  };
  /// Makes what is to be shown, if that is due: `build` does it with Dear ImGui's functions, and says how much of the
  /// window's left side nothing shines through, in screen coordinates. Null: nothing is shown, and nothing takes the
  /// pointer. Returns that part in pixels: what lies below need not be drawn.
  int prepare(const Place& place, double now_s, const std::function<double()>& build);
  /// Draws it over the default framebuffer.
  void show(const Place& place);

 private:
  struct Impl;
  explicit Gui(std::unique_ptr<Impl> impl);
  void stir();
  bool shows() const;
  bool take_typed();
  void build_texture(const Place& place, const std::function<double()>& build);

  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::viewer
