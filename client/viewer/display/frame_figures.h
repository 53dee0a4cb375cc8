// Figures of a displayed frame: how it was drawn, when it was shown, and what the viewer had received by then.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/stereo/mode.h"
#include "client/viewer/coupling/coupling.h"
#include "client/viewer/display/eyes/eye_rig.h"
#include "client/viewer/input/look.h"
#include "client/viewer/input/tracked_head.h"
#include "client/viewer/render/renderer_trial.h"
#include "common/splat/cpu_splatter.h"

namespace telesplat::viewer {

/// The part of a still picture that was drawn with sub-pixels.
struct Refinement {
  double share = 0;    ///< share of its pixels
  double ms = 0;       ///< time that this frame spent on it
  int sub_pixels = 1;  ///< sub-pixels of such a pixel, on each axis
};

/// Columns of frames.csv that depend on the source (docs/metrics.md).
struct DrawnFrame {
  bool empty = true;        ///< there was nothing of the scene to draw
  bool changed = true;      ///< false: the view is as FrameInput::intact found it
  bool still = false;       ///< nothing was drawn: the picture of the frame before stands
  double chosen_s = 0;      ///< monotonic clock: when the choice of what to draw was made
  splat::SplatStats stats;  ///< for volumes the warp counts as resolving
  uint64_t selected = 0, drawn = 0, items = 0, cached = 0, sequence = 0;
  uint64_t summaries = 0;  ///< summaries of bricks made so far
  double detail = 1, budget_ms = 0;
  bool halved = false;  ///< drawn at half its size (splat::RenderOptions)
  Refinement refined;
  EpochId epoch;
  bool between_clips = false;  ///< it has the session's present clip, and points from an epoch before it
  ShownUpdate update;          ///< newest view update in the frame
  /// Camera of a picture that a server drew; such a picture has no depth.
  std::optional<geometry::Camera> picture_of;
};

/// Two eyes' part of a measured frame.
struct MeasuredEyes {
  stereo::Mode mode = stereo::Mode::kOff;
  EyePair pair;
};

/// The time at which a person could see a frame.
struct Seen {
  double at_s = 0;       ///< when it was presented; in a headset the refresh that shows it
  double refresh_s = 0;  ///< time between two refreshes; 0: not known
  double lead_s = 0;     ///< headset: time from its handing over until it was due
  int missed = 0;        ///< refreshes before it that showed no new picture
};

/// A wall's part of a measured frame.
struct MeasuredSwap {
  uint64_t frame = 0;  ///< its number in the wall; 0: no wall, or no word on when to present it
  double wait_s = 0;   ///< from its end until the wall's frames were due
  double skew_s = -1;  ///< time between the wall's first and last display to present it; < 0: not known
};

/// A displayed frame's measurements. Times are on the monotonic clock.
struct MeasuredFrame {
  uint64_t number = 0;
  double start_s = 0;     ///< when the display began
  double previous_s = 0;  ///< when the frame before was finished; 0: this is the first
  double begin_s = 0, end_s = 0, presented_s = 0;
  double begin_master_s = 0;  ///< begin_s on the master's clock
  double wait_s = 0;          ///< wait for the update, before begin_s
  double update_age_s = 0;    ///< time since the request of the update that it shows
  Seen seen{};
  PoseMoment posed{};  ///< when its head's pose was taken
  geometry::Camera camera{};
  geometry::Pose head{};  ///< the head that it was drawn for; on a wall's screen not the camera's pose
  Look look{};
  DrawnFrame drawn{};
  int filled = 0;            ///< complete updates that waited to be displayed
  CouplingState coupling{};  ///< the coupling in force
  MeasuredSwap swap{};
  MeasuredEyes stereo{};

  /// Time from the end of the frame before to the end of this one; 0: it was the first.
  double inter_frame_ms() const { return previous_s > 0 ? (end_s - previous_s) * 1e3 : 0; }
};

/// The worker's figures. Counters count from the beginning.
struct SessionFigures {
  std::string scene;      ///< name of the data set; empty until the master sent it
  uint64_t updates = 0;   ///< completely received
  double latency_ms = 0;  ///< the newest view update, request to complete; 0 before the first
  uint64_t bytes_received = 0;
  uint64_t epochs_shown = 0;                  ///< how often a changed scene replaced the one on display
  int sampled_width = 0, sampled_height = 0;  ///< pixels of the newest view request; 0: no request yet
  RendererChoice::Figures renderer{};
};

/// Units of DrawnFrame::drawn and of DrawnFrame::cached, for people.
struct DrawnUnits {
  const char* drawn = "points";
  const char* cached = "";  ///< with a space before it
};

/// Figures after a frame.
struct FrameFigures {
  double now_s = 0;     ///< monotonic clock
  uint64_t frames = 0;  ///< displayed so far
  double waits_s = 0;   ///< time that the display has waited for a view update; 0: not for long
  MeasuredFrame frame{};
  DrawnUnits units{};
  SessionFigures session{};
};

}  // namespace telesplat::viewer
