// frames.csv (docs/metrics.md): a row for each displayed frame, a line of frame_table.cpp for each column.
#pragma once

#include <string>
#include <vector>

#include "client/stereo/mode.h"
#include "client/viewer/coupling/coupling.h"
#include "client/viewer/display/eyes/eye_rig.h"
#include "client/viewer/display/view_source.h"

namespace telesplat::viewer {

/// Of a frame that two eyes see.
struct MeasuredEyes {
  stereo::Mode mode = stereo::Mode::kOff;
  EyePair pair;
};

/// A displayed frame as it was measured. Times are those of the monotonic clock.
struct MeasuredFrame {
  uint64_t number = 0;
  double start_s = 0;     ///< the display began
  double previous_s = 0;  ///< the frame before was finished; 0: there was none
  double begin_s = 0, end_s = 0, presented_s = 0;
  double begin_master_s = 0;  ///< begin_s on the master's clock
  double wait_s = 0;          ///< for the update, before begin_s
  double update_age_s = 0;    ///< since the update that it shows was requested
  double seen_s = 0;          ///< a person could see it: presented_s, in a headset the refresh that shows it
  PoseMoment posed{};         ///< of the head that it shows
  double refresh_s = 0;       ///< between two refreshes that it could be shown at; 0: there are none
  geometry::Camera camera{};
  geometry::Pose head{};  ///< that it was drawn for; of a screen of a wall not the camera's
  Look look{};
  DrawnFrame drawn{};
  int filled = 0;            ///< complete updates that waited to be displayed
  CouplingState coupling{};  ///< that was in force
  uint64_t wall_frame = 0;   ///< its number among the wall's; 0: it is none, or none told when to present it
  double swap_wait_s = 0;    ///< from its end until the wall's frames were due
  double swap_skew_s = -1;   ///< from the first of the wall's displays to present it to the last; < 0: not known
  MeasuredEyes stereo{};
  double lead_s = 0;  ///< of a headset: it was handed over so long before it was due
  int missed = 0;     ///< refreshes that went by without a new picture before it
};

/// Refreshes between two moments, both presented, that showed nothing new; 0 where there are none.
int refreshes_missed(double previous_s, double presented_s, double refresh_s);

std::vector<std::string> frame_columns();
std::vector<double> frame_row(const MeasuredFrame& frame);

}  // namespace telesplat::viewer
