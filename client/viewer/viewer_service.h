// The viewer process (T3.3.3): a replica of the point model, a display that never waits, measurements of itself.
#pragma once

#include "client/viewer/display/display_loop.h"

namespace telesplat::viewer {

struct ViewerOptions {
  net::ServiceOptions service;
  DisplayOptions display;
  RequestOptions requests;
  std::string size = "1280x800", sampling_size = "auto";  ///< pixels, WxH; sampling: or auto
  std::string trajectory = "orbit";                       ///< "orbit", "still" or a CSV file
  std::string renderer = "auto", splat = "disc", coupling = "async", shading = "lit", finish = "on";
  int buffers = 3;    ///< of loose coupling
  std::string wall;   ///< "CxR": this display is a tile of a wall; empty: it is none
  int wall_tile = 0;  ///< which one, by rows from the upper left
  double epoch_patience_s =
      0.15;                ///< a changed scene's old points stay on display for so long if the new ones are late
  double splat_scale = 0;  ///< scale factor of splat sizes (T eq. 4.8); 0: what suits the kernel
  int threads = 0;
  uint64_t record_points_mb = 1024;  ///< point-model events kept in the run folder, MiB at most; 0: none
  bool window = false;               ///< show a window instead of running headless
  bool fullscreen = false;           ///< the window fills the screen
  double started_s = 0;              ///< when the session was started (monotonic clock), for start-up times; 0: now
  bool end_session = false;          ///< tell the master to end the session once this viewer's run is over and recorded
  std::string out;                   ///< run folder; empty: nothing is recorded
};

/// Flags that `telesplat run` and `view` have too: size, trajectory, renderer and the like.
void add_view_flags(CLI::App& app, ViewerOptions& options);
void add_flags(CLI::App& app, ViewerOptions& options);

/// "WxH" with both in 16..16384.
Result<std::pair<int, int>> parse_size(const std::string& text, const char* flag);

/// The same, or "auto" (then the value is not used).
Result<std::pair<int, int>> parse_sampling_size(const std::string& text);

/// "CxR" with 1 to 16 columns and rows.
Result<std::pair<int, int>> parse_wall(const std::string& text);

/// Exit code: 0 done, 1 failed while running (with end_session: also if the session ended before anything was shown), 2 bad usage or
/// input. A signal ends it within 2 s: recorded frames that are not pictures by then stay in OUT/spool.
int run(ViewerOptions options);

}  // namespace telesplat::viewer
