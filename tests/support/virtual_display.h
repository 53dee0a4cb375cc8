// An X server without a screen, and calls that use its keyboard and mouse, for tests of windows.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

#include "common/image/file.h"

namespace telesplat::test {

/// Starts an Xvfb on a free display number and makes it this process's DISPLAY; the destructor ends both.
class VirtualDisplay {
 public:
  using WindowId = unsigned long;

  /// True if Xvfb is installed.
  static bool installed();
  VirtualDisplay();
  ~VirtualDisplay();
  VirtualDisplay(const VirtualDisplay&) = delete;
  VirtualDisplay& operator=(const VirtualDisplay&) = delete;
  /// False: the server did not start.
  bool ready() const { return connection_ != nullptr; }

  /// Finds the window whose title contains `text`.
  std::optional<WindowId> find(const std::string& text) const;
  /// Empty once the window is gone.
  std::string title(WindowId window) const;
  /// Reads the window's picture, if it is visible.
  std::optional<image::View> content(WindowId window) const;

  // Events reach the window in the order of these calls. Positions are pixels of the window.
  void move_pointer(WindowId window, int x, int y);
  void button(int number, bool down);
  /// Presses and releases a key; keysym: an X name, "p" or "F12". with: another key that is held meanwhile, or empty.
  void tap(const std::string& keysym, const std::string& with = "");
  void resize(WindowId window, int width, int height);
  /// Drops a file, as a file manager does (XDND). False: the window did not ask for it.
  bool drop_file(WindowId window, const std::string& path);
  /// Sends the window manager's message for a window that the person closes.
  void close(WindowId window);

  /// Sets the screen's density, as desktops do: dots an inch, 96 on an ordinary screen. For windows that open later.
  void set_density(int dots_an_inch);

  /// Ends the server, as when the person's session or a forwarded connection ends. Only the destructor may follow.
  void go_away();

 private:
  pid_t server_ = -1;
  void* connection_ = nullptr;
  std::optional<std::string> display_before_, wayland_before_;
};

}  // namespace telesplat::test
