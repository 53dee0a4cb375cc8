// Makes the line of live figures in a window's title.
#pragma once

#include <optional>
#include <string>

#include "client/displays/window/input/head_path.h"
#include "client/viewer/display/frame_figures.h"

namespace telesplat::viewer {

class TitleLine {
 public:
  /// Returns a new title when one is due: at once when the scene or its first view is known, then twice a second. Rates
  /// are means since the last title:
  ///   SCENE - 59.9 fps, 4.0 updates/s, 212 ms latency, 0.41 M points drawn, 1.20 M cached, 2.31 MB/s
  /// (for a volume 12.31 M samples drawn, 2.10 M pixels cached) and, while the scene changes, its changes a second on
  /// display:
  ///   ..., 5.8 epochs/s
  /// and if the display waits for long:
  ///   SCENE - waiting for a view update, 3 s
  std::optional<std::string> update(const FrameFigures& figures);
  /// Does the same for a window whose camera's path may be recorded: the title tells its length, too.
  std::optional<std::string> update(const FrameFigures& figures, const PathRecorder& path);

 private:
  std::optional<FrameFigures> last_;
  std::string text_, shown_;
};

}  // namespace telesplat::viewer
