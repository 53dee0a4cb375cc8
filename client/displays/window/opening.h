// How a window comes to show something else: the dialog, files that are dropped on it, and what the launcher says.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client/displays/window/panel/gui/open_view.h"
#include "client/displays/window/panel/panel.h"
#include "client/displays/window/panel/scene_controls.h"
#include "client/displays/window/window.h"

namespace telesplat::viewer {

/// Lines from a file descriptor, read without waiting. The launcher sends
///   progress TEXT   what goes on, for people: "reading a.ply 43 %, 12 s left"; without TEXT: nothing
///   problem TEXT    why a data set could not be opened
/// One thread.
class LauncherLines {
 public:
  static constexpr size_t kLongest = 4096;  ///< bytes of a line; what is longer is cut

  /// Reads from `fd`, which becomes non-blocking; negative: no process reports.
  explicit LauncherLines(int fd);
  /// Whole lines that came since the last call.
  std::vector<std::string> read();
  bool open() const { return fd_ >= 0; }

 private:
  int fd_;
  std::string part_;
};

/// One thread. What it is made of must live longer.
class Opening {
 public:
  using Tell = std::function<void(const std::string& line)>;
  /// ask: asks the launcher for another data set; null: the session is somebody else's.
  Opening(std::function<void(const std::string& path)> ask, int launcher_fd, Interaction& interaction, Panel& panel,
          SceneControls& scene, Tell tell)
      : ask_(std::move(ask)),
        launcher_(launcher_fd),
        interaction_(interaction),
        panel_(panel),
        scene_(scene),
        tell_(std::move(tell)) {}

  bool shows_dialog() const { return view_.shown; }
  /// has_scene: there is a data set, or is about to be one. seen: it is on display.
  void take_launcher_lines(double now_s, bool has_scene, bool seen);
  void take_dropped(Window& window);
  /// The dialog, if it is shown; between Dear ImGui's frames.
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
