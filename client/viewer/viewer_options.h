// The viewer's flags: one row a flag, and the options that they give. Without sockets, OpenGL and display code, because
// the launcher uses them too.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "client/viewer/coupling/request_options.h"
#include "client/viewer/display/display_options.h"
#include "client/viewer/display/size_text.h"
#include "client/viewer/input/head_movement.h"
#include "client/viewer/stereo_flags.h"
#include "common/net/service.h"
#include "common/options/table.h"

namespace telesplat::viewer {

struct ViewerOptions {
  net::ServiceOptions service;
  DisplayOptions display;
  RequestOptions requests;
  std::string size = "1280x800", sampling_size = "auto";  ///< pixels, WxH; sampling_size also auto
  /// Sampled pixels a displayed pixel, on each axis, at least; not given: the session's setting, else
  /// requests.min_scale.
  std::optional<double> least_sampling;
  std::string trajectory;    ///< "orbit", "still" or a CSV file; empty: orbit, in a window or with an eye still
  std::string eye, look_at;  ///< "x,y,z" of the first view, metres in the room; empty: fitted to the data set
  std::string poses;         ///< endpoint of a publisher of poses that moves the head; empty: none
  std::string prediction = "kalman";  ///< predictor for poses: "none", "velocity" or "kalman"
  double pose_horizon_s = 0;          ///< how far ahead displayed poses of `poses` are predicted; 0: by a frame's time
  bool loop = false;                  ///< the trajectory of a file begins again where it ends
  HeadMovement movement;              ///< made from trajectory, eye, look_at and loop
  /// Seconds from the first displayed frame, 0: until stopped; not given: as long as the trajectory of a file (and
  /// display.hold_s) takes, else 10, in a window until it is closed.
  std::optional<double> duration_s;
  std::string background = "#141820";  ///< "#rrggbb", a name, or "transparent"
  std::string renderer = "auto", splat = "disc", coupling = "async", shading = "lit", finish = "on";
  std::string still_samples = "16";
  StereoFlags stereo;         ///< becomes display.stereo
  int buffers = 3;            ///< buffers of loose coupling
  std::string wall;           ///< "CxR", or a description's file: this display is a part of a wall; empty: no wall
  int wall_tile = 0;          ///< which tile, by rows from the upper left, or which of the file's screens
  double wall_scale = 1;      ///< with a description: factor on the screens' pixels, on each axis
  bool swap_barrier = true;   ///< a wall's displays present their frames together
  double update_rate_hz = 0;  ///< view requests a second at most; 0: as many as suit the display
  double splat_scale = 0;     ///< scale factor of splat sizes (T eq. 4.8); 0: that which suits the kernel
  int threads = 0;
  uint64_t record_points_mb = 1024;  ///< point-model events kept in the run folder, MiB at most; 0: no record
  bool window = false;               ///< show a window instead of running headless
  bool fullscreen = false;           ///< the window fills the screen
  bool panel = true;                 ///< the panel is open when the window appears
  bool launched = false;             ///< the launcher writes to standard input (LauncherLines) and opens data sets
  bool begins_empty = false;         ///< launched: there is no data set yet
  bool xr = false;                   ///< show it in a headset, through OpenXR
  XrOptions xr_options;
  std::string xr_origin;     ///< "x,y,z" of xr_options.origin_m; empty: that which suits the headset's space
  double started_s = 0;      ///< when the session was started (monotonic clock), for start-up times; 0: now
  bool end_session = false;  ///< ask the master to end the session once this viewer's run is over and recorded
  std::string out;           ///< run folder; empty: the session's, if this machine has it
  bool join_record = true;   ///< without `out`: keep a record in the session's folder
};

/// True if a person is there, who ends the run.
inline bool has_person(const ViewerOptions& o) { return o.window || o.xr; }

/// Flags of headsets, for telesplat-viewer and `telesplat view`.
options::Table xr_table(ViewerOptions& options);
/// Flags that `telesplat run` and `view` share: size, trajectory, renderer and the like.
options::Table view_table(ViewerOptions& options);
/// Flags of walls, which `telesplat run` shares.
options::Table wall_table(ViewerOptions& options);
/// All flags of telesplat-viewer.
options::Table table(ViewerOptions& options);

/// "WxH", or "auto" (then the value is not used).
Result<std::pair<int, int>> parse_sampling_size(const std::string& text);

/// Turns the texts of the flags into options: sizes, the head's movement (reads its file), the tile of the wall,
/// kernels, buffers of the coupling. Error: names the flag that is wrong.
Status settle(ViewerOptions& options);

/// True if the display presents its frames together with other displays.
inline bool in_step(const ViewerOptions& options) { return options.swap_barrier && options.display.wall.tiles() > 1; }

/// Returns a line for the person that says what happens where the trajectory of a file ends before the viewer does;
/// empty: that does not happen. Precondition: the options are settled.
std::string end_of_trajectory(const ViewerOptions& options);

/// Says what is wrong with "X,Y,Z"; empty: it is a point.
std::string complain_about_point(const std::string& text);
/// Flags of pose publishers and of prediction.
options::Table head_source_table(ViewerOptions& options);
/// Settles those flags and the headset's. Error: names the flag that is wrong.
Status settle_head_source(ViewerOptions& options);

}  // namespace telesplat::viewer
