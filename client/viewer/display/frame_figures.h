// What people are told of the display while it shows: in a window's title and panel.
#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include "client/viewer/coupling/coupling.h"
#include "client/viewer/render/renderer_trial.h"

namespace telesplat::viewer {

/// What is known after a frame. Counters count from the beginning.
struct FrameFigures {
  double now_s = 0;                  ///< monotonic clock
  std::string scene;                 ///< name of the data set; empty until the master told it
  uint64_t frames = 0, updates = 0;  ///< displayed; completely received
  double latency_ms = 0;             ///< of the newest view update, request to complete; 0 before the first
  uint64_t points_drawn = 0, points_cached = 0, bytes_received = 0;
  uint64_t epochs_shown = 0;          ///< times a changed scene took the place of the one on display
  const char* drawn_name = "points";  ///< what points_drawn counts
  const char* cached_name = "";       ///< and points_cached, with a space before it
  double waits_s = 0;                 ///< seconds that the display has waited for a view update; 0: not for long
  double inter_frame_ms = 0;          ///< from the end of the frame before to the end of this one; 0: it was the first
  CouplingState coupling;
  double detail = 1;                          ///< splat::SelectionOptions::detail of the frame
  int sampled_width = 0, sampled_height = 0;  ///< of the newest view request; 0: there was none
  /// Share of the object's picture that is holes; NaN: not known.
  double hole_share = std::numeric_limits<double>::quiet_NaN();
  RendererChoice::Figures renderer;
};

}  // namespace telesplat::viewer
