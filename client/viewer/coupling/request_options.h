// Options of view requests.
#pragma once

#include <cstdint>
#include <string>

#include "client/viewer/tracking/pose_predictor.h"

namespace telesplat::viewer {

struct RequestOptions {
  int sampling_width = 1280, sampling_height = 800;
  double max_rate_hz = 20;          ///< requests a second at most; the master keeps only the newest
  double max_margin = 0.3;          ///< the sampled frustum is at most this fraction wider than the displayed one
  double initial_latency_s = 0.25;  ///< assumed until a latency is measured
  /// Sample as finely as updates of target_latency_s allow, and a still view exactly; the size above is not used.
  bool adaptive = false;
  double target_latency_s = 0.15;  ///< adaptive: longer updates make sampling coarser, shorter ones finer
  double min_scale = 0.5;          ///< adaptive: sampled pixels a displayed pixel, on each axis, at least (at most 1)
  /// Replaces min_scale while the scene changes and each view is displayed only for a moment.
  double min_scale_changing = 0.25;
  uint64_t buffers = 0;  ///< 0: asynchronous; else requests are paced by credits (coupling.h) and not by max_rate_hz
  tracking::Prediction prediction = tracking::Prediction::kKalman;
  std::string wall;           ///< wire::ViewRequest
  uint64_t wall_viewers = 0;  ///< number of the wall's viewers
  /// The servers draw the views: requests are for the display's camera and the head's present pose, at most
  /// picture_rate_hz, and as far as credits go. A head that rests asks once more, for a finer picture.
  bool pictures = false;
  double picture_rate_hz = 60;
  bool follow_display = false;  ///< sample as many pixels, in the display's aspect: for windows that change their size
};

/// A person's wish for the sampling of views, made while looking.
struct SamplingWish {
  bool adaptive = true;         ///< as fine as updates in time allow (RequestOptions); else the size below
  int width = 0, height = 0;    ///< not adaptive: pixels; a window keeps their number in its own aspect
  double least_sampling = 0.5;  ///< adaptive: sampled pixels a displayed pixel, on each axis, at least
  bool operator==(const SamplingWish&) const = default;
};

}  // namespace telesplat::viewer
