// Opens other data in a window: the dialog, files that are dropped on it, and lines from the launcher.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client/displays/window/panel/gui/open_view.h"
#include "client/displays/window/panel/panel.h"
#include "client/displays/window/panel/scene_controls.h"
#include "client/displays/window/window.h"

namespace telesplat::viewer {

/// Reads lines from a file descriptor without waiting. The launcher sends
///   progress TEXT   the present step, for people: "reading a.ply 43 %, 12 s left"; without TEXT: none
///   problem TEXT    why a data set could not be opened
/// Used by one thread.
class LauncherLines {
 public:
  static constexpr size_t kLongest = 4096;  ///< bytes of a line; the rest of it is cut off

  /// Reads from `fd`, which becomes non-blocking; negative: there is no launcher.
  explicit LauncherLines(int fd);
  /// Returns whole lines that came since the last call.
  std::vector<std::string> read();
  bool open() const { return fd_ >= 0; }

 private:
  int fd_;
  std::string part_;
};

/// Used by one thread. The constructor's arguments must live longer.
class Opening {
 public:
  using Tell = std::function<void(const std::string& line)>;
  /// ask: asks the launcher for another data set; null: another person's session, which this window may not replace.
  Opening(std::function<void(const std::string& path)> ask, int launcher_fd, Interaction& interaction, Panel& panel,
          SceneControls& scene, Tell tell)
      : ask_(std::move(ask)),
        launcher_(launcher_fd),
        interaction_(interaction),
        panel_(panel),
        scene_(scene),
        tell_(std::move(tell)) {}

  bool shows_dialog() const { return view_.shown; }
  /// has_scene: there is a data set, or one is being opened. seen: it is on display.
  void take_launcher_lines(double now_s, bool has_scene, bool seen);
  void take_dropped(Window& window);
  /// Builds the dialog, if it is shown, between Dear ImGui's frames.
  void build(bool has_scene);

 private:
  void open(const std::string& path);
  void play_file(const std::string& path);
  void use_transfer_file(const std::string& path);

  std::function<void(const std::string&)> ask_;
  LauncherLines launcher_;
  Interaction& interaction_;
  Panel& panel_;
  SceneControls& scene_;
  Tell tell_;
  OpenViewState view_;
};

}  // namespace telesplat::viewer
