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

/// Names the movement of the head, and its prediction.
struct HeadFlags {
  std::string trajectory;    ///< "orbit", "still" or a CSV file; empty: orbit, in a window or with an eye still
  std::string eye, look_at;  ///< "x,y,z" of the first view, metres in the room; empty: fitted to the data set
  std::string poses;         ///< endpoint of a publisher of poses that moves the head; empty: none
  std::string prediction = "kalman";  ///< predictor for poses: "none", "velocity" or "kalman"
  double pose_horizon_s = 0;          ///< how far ahead displayed poses of `poses` are predicted; 0: by a frame's time
  bool loop = false;                  ///< the trajectory of a file begins again where it ends
  HeadMovement movement;              ///< made from trajectory, eye, look_at and loop
  /// Seconds from the first displayed frame, 0: until stopped; not given: as long as the trajectory of a file (and
  /// DisplaySpan::hold_s) takes, else 10, in a window until it is closed.
  std::optional<double> duration_s;
};

/// Names of renderer and look; they become DisplayOptions::render and ::shading.
struct DrawingFlags {
  std::string background = "#141820";  ///< "#rrggbb", a name, or "transparent"
  std::string renderer = "auto", splat = "disc", shading = "lit", finish = "on";
  std::string still_samples = "16";
  double splat_scale = 0;  ///< scale factor of splat sizes (T eq. 4.8); 0: that which suits the kernel
  int threads = 0;
};

struct CouplingFlags {
  std::string mode = "async";
  int buffers = 3;            ///< buffers of loose coupling
  double update_rate_hz = 0;  ///< view requests a second at most; 0: as many as suit the display
};

/// A display that is a part of a wall.
struct WallFlags {
  std::string name;          ///< "CxR", or a description's file; empty: no wall
  int tile = 0;              ///< which tile, by rows from the upper left, or which of the file's screens
  double scale = 1;          ///< with a description: factor on the screens' pixels, on each axis
  bool swap_barrier = true;  ///< a wall's displays present their frames together

  /// Returns the name that all viewers of the wall give to it.
  std::string shared_name() const;
};

struct WindowFlags {
  bool shown = false;         ///< show a window instead of running headless
  bool fullscreen = false;    ///< the window fills the screen
  bool panel = true;          ///< the panel is open when the window appears
  bool launched = false;      ///< the launcher writes to standard input (LauncherLines) and opens data sets
  bool begins_empty = false;  ///< launched: there is no data set yet
};

struct XrFlags {
  bool on = false;  ///< show it in a headset, through OpenXR
  XrOptions options;
  std::string origin;  ///< "x,y,z" of options.origin_m; empty: that which suits the headset's space
};

struct ViewerOptions {
  net::ServiceOptions service;
  DisplayOptions display;
  RequestOptions requests;
  std::string size = "1280x800", sampling_size = "auto";  ///< pixels, WxH; sampling_size also auto
  /// Sampled pixels a displayed pixel, on each axis, at least; not given: the session's setting, else
  /// requests.min_scale.
  std::optional<double> least_sampling;
  HeadFlags head;
  DrawingFlags drawing;
  CouplingFlags coupling;
  StereoFlags stereo;  ///< becomes display.stereo
  WallFlags wall;
  WindowFlags window;
  XrFlags xr;
  RecordOptions record;
  double started_s = 0;      ///< when the session was started (monotonic clock), for start-up times; 0: now
  bool end_session = false;  ///< ask the master to end the session once this viewer's run is over and recorded
};

/// True if a person is there, who ends the run.
inline bool has_person(const ViewerOptions& o) { return o.window.shown || o.xr.on; }

/// Flags of headsets, for telesplat-viewer and `telesplat view`.
options::Table xr_table(XrFlags& flags);
/// Flags that `telesplat run` and `view` share: size, trajectory, renderer and the like.
options::Table view_table(ViewerOptions& options);
/// Flags of walls, which `telesplat run` shares.
options::Table wall_table(WallFlags& flags);
/// All flags of telesplat-viewer.
options::Table table(ViewerOptions& options);

/// "WxH", or "auto" (then the value is not used).
Result<std::pair<int, int>> parse_sampling_size(const std::string& text);

/// Turns the texts of the flags into options: sizes, the head's movement (reads its file), the tile of the wall,
/// kernels, buffers of the coupling. Error: names the flag that is wrong.
Status settle(ViewerOptions& options);

/// True if the display presents its frames together with other displays.
inline bool in_step(const ViewerOptions& options) {
  return options.wall.swap_barrier && options.display.wall.tiles() > 1;
}

/// Returns a line for the person that says what happens where the trajectory of a file ends before the viewer does;
/// empty: that does not happen. Precondition: the options are settled.
std::string end_of_trajectory(const ViewerOptions& options);

/// Says what is wrong with "X,Y,Z"; empty: it is a point.
std::string complain_about_point(const std::string& text);
/// Flags of pose publishers and of prediction.
options::Table head_source_table(HeadFlags& flags);
/// Settles those flags and the headset's. Error: names the flag that is wrong.
Status settle_head_source(ViewerOptions& options);

}  // namespace telesplat::viewer
