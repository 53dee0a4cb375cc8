// The viewer process (T3.3.3): keeps what it receives, a display that never waits, measurements of itself.
// Displays beside the headless one are functions that open them. telesplat-viewer holds none, so it builds without
// libraries of window systems and headsets; telesplat-display holds those of client/displays.
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
  net::Access asking;                            ///< may change the session for everyone, if the person may
  std::shared_ptr<PoseFeed> poses;               ///< moves the head; null: nothing does
  std::function<void(const std::string&)> tell;  ///< lines for the person
};

/// Opens a display. The options are settled; a display of another size changes them. Error: why it cannot be opened.
using OpenDisplay =
    std::function<Result<std::unique_ptr<DisplaySurface>>(ViewerOptions& options, const DisplayHelp& help)>;

/// Null: the program holds no such display.
struct Displays {
  OpenDisplay window, headset;
};

inline constexpr const char* kDisplayProgram = "telesplat-display";
/// The path of kDisplayProgram beside this program. Error: it is not there; names what builds it.
Result<std::string> display_program();
/// Becomes kDisplayProgram, with the same arguments. Returns only if it cannot: an exit code, after telling why.
int become_display_program(char** argv);

/// Exit code: 0 done, 1 failed while running (with end_session: also if the session ended before anything was shown), 2
/// bad usage or input. A signal ends it within 2 s: recorded frames that are not pictures by then stay in OUT/spool.
Result<int> run(ViewerOptions options, const Displays& displays = {});

/// telesplat-viewer and telesplat-display: the same flags, and one name for people and records.
int viewer_main(int argc, char** argv, const Displays& displays);

}  // namespace telesplat::viewer
