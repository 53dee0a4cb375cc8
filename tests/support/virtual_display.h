// An X server without a screen, and hands on its keyboard and mouse, for tests of windows.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

#include "common/image/file.h"

namespace telesplat::test {

/// Starts an Xvfb on a free display number, makes it this process's DISPLAY and ends it, and that, again.
class VirtualDisplay {
 public:
  using WindowId = unsigned long;

  /// Whether there is an Xvfb to start.
  static bool installed();
  VirtualDisplay();
  ~VirtualDisplay();
  VirtualDisplay(const VirtualDisplay&) = delete;
  VirtualDisplay& operator=(const VirtualDisplay&) = delete;
  /// False: the server did not come up.
  bool ready() const { return connection_ != nullptr; }

  /// The window on display whose title contains `text`.
  std::optional<WindowId> find(const std::string& text) const;
  /// Empty once the window is gone.
  std::string title(WindowId window) const;
  /// What the window shows, if it is visible.
  std::optional<image::View> content(WindowId window) const;

  // Events reach the window in the order of these calls. Positions are pixels of the window.
  void move_pointer(WindowId window, int x, int y);
  void button(int number, bool down);
  /// Presses and releases; keysym: an X name, "p" or "F12". with: the same of a key that is held meanwhile, or empty.
  void tap(const std::string& keysym, const std::string& with = "");
  void resize(WindowId window, int width, int height);
  /// Drops a file, as a file manager does (XDND). False: the window did not ask for it.
  bool drop_file(WindowId window, const std::string& path);
  /// What a window manager sends when the person closes a window.
  void close(WindowId window);

  /// What desktops tell programs of their screen: so many dots an inch, 96 of a plain one. For windows that open later.
  void set_density(int dots_an_inch);

  /// The server ends, as when the person's session or a forwarded connection does. Nothing else can be asked then.
  void go_away();

 private:
  pid_t server_ = -1;
  void* connection_ = nullptr;
  std::optional<std::string> display_before_, wayland_before_;
};

}  // namespace telesplat::test
