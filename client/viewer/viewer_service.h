// The viewer process (T3.3.3): keeps what it receives, drives a display that never waits, and measures itself. Displays
// other than the headless one are opened by functions. telesplat-viewer has none, so it builds without libraries of
// window systems and headsets; telesplat-display has those of client/displays.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "client/viewer/display/display_surface.h"
#include "client/viewer/input/pose_feed.h"
#include "client/viewer/viewer_options.h"
#include "common/net/keys/access.h"

namespace telesplat::viewer {

struct DisplayHelp {
  net::Access asking;               ///< for orders that change the session for all, if the person may give these
  std::shared_ptr<PoseFeed> poses;  ///< moves the head; null: there is no feed
  std::function<void(const std::string&)> tell;  ///< prints lines for the person
};

/// Opens a display of settled options; a display of another size changes them. Error: why it cannot be opened.
using OpenDisplay =
    std::function<Result<std::unique_ptr<DisplaySurface>>(ViewerOptions& options, const DisplayHelp& help)>;

/// Null: the program has no such display.
struct Displays {
  OpenDisplay window, headset;
};

inline constexpr const char* kDisplayProgram = "telesplat-display";
/// Returns the path of kDisplayProgram beside this program. Error: it is not there; names the target that builds it.
Result<std::string> display_program();
/// Becomes kDisplayProgram, with the same arguments. Returns an exit code only if it cannot, after it printed why.
int become_display_program(char** argv);

/// Exit code: 0 done, 1 failed while running (with end_session: also if the session ended before its first picture), 2
/// bad usage or input. A signal ends it within 2 s: recorded frames that are not pictures by then stay in OUT/spool.
Result<int> run(ViewerOptions options, const Displays& displays = {});

/// main() of telesplat-viewer and telesplat-display: the same flags, and one name for people and records.
int viewer_main(int argc, char** argv, const Displays& displays);

}  // namespace telesplat::viewer
