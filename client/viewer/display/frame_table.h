// frames.csv (docs/metrics.md): one row for each displayed frame; frame_table.cpp has one line for each column.
#pragma once

#include <string>
#include <vector>

#include "client/stereo/mode.h"
#include "client/viewer/coupling/coupling.h"
#include "client/viewer/display/eyes/eye_rig.h"
#include "client/viewer/display/view_source.h"

namespace telesplat::viewer {

/// Two eyes' part of a measured frame.
struct MeasuredEyes {
  stereo::Mode mode = stereo::Mode::kOff;
  EyePair pair;
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
  double seen_s = 0;          ///< when a person could see it: presented_s, in a headset the refresh that shows it
  PoseMoment posed{};         ///< when its head's pose was taken
  double refresh_s = 0;       ///< time between two refreshes; 0: not known
  geometry::Camera camera{};
  geometry::Pose head{};  ///< the head that it was drawn for; on a wall's screen not the camera's pose
  Look look{};
  DrawnFrame drawn{};
  int filled = 0;            ///< complete updates that waited to be displayed
  CouplingState coupling{};  ///< the coupling in force
  uint64_t wall_frame = 0;   ///< its number in the wall; 0: no wall, or no word on when to present it
  double swap_wait_s = 0;    ///< from its end until the wall's frames were due
  double swap_skew_s = -1;   ///< time between the wall's first and last display to present it; < 0: not known
  MeasuredEyes stereo{};
  double lead_s = 0;  ///< headset: time from its handing over until it was due
  int missed = 0;     ///< refreshes before it that showed no new picture
};

/// Counts the refreshes between two moments, both presented, that showed nothing new; 0 if there are no refreshes.
int refreshes_missed(double previous_s, double presented_s, double refresh_s);

std::vector<std::string> frame_columns();
std::vector<double> frame_row(const MeasuredFrame& frame);

}  // namespace telesplat::viewer
