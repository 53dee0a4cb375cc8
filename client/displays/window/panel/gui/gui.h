// Runs Dear ImGui in a GLFW window: passes events to it, and draws it over frames.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "common/core/result.h"

struct GLFWwindow;

namespace telesplat::viewer {

/// Widgets are drawn into a texture after an event, or every tenth of a second; each frame only blends that texture: so
/// an idle panel costs little. One at a time in a process. The window's context is current in make(), prepare(), show()
/// and the destructor. Used by one thread.
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

  /// True if pointer events at this place (screen coordinates of the window) belong to a widget.
  bool takes_pointer(double x, double y) const;
  /// True if keys belong to a text that is being typed.
  bool takes_text() const;
  /// expected: letters belong to a text that does not have the focus yet: they wait for it.
  void expect_text(bool expected);
  /// Closes the list or colour picker that an item opened. False: there is no open one.
  bool close_popup();
  /// True if a new build may differ from the last one.
  bool due(double now_s) const;

  struct Place {
    int width = 0, height = 0;  ///< the default framebuffer, pixels
    double content_scale = 1;   ///< scale of the display; 2: texts should have twice as many pixels
  };
  /// Builds the texture if that is due. build: calls Dear ImGui's functions, and returns the width at the window's left
  /// side that is fully covered, in screen coordinates. Null: there are no widgets, and the pointer belongs to the
  /// scene. Returns that width in pixels: the frame below it need not be drawn.
  int prepare(const Place& place, double now_s, const std::function<double()>& build);
  /// Draws the texture over the default framebuffer.
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
