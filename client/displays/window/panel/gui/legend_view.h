// The legend over the window, in the panel's letters: it can be dragged to another place, and the range of a mesh's
// colours changed on it.
#pragma once

#include <functional>

#include "common/image/legend.h"

namespace telesplat::viewer {

/// State between frames.
struct LegendViewState {
  bool right = true, low = true;       ///< the nearest corner
  float from_side = -1, from_end = 0;  ///< distance from it, screen coordinates; negative: it was not moved
  double lo = 0, hi = 0;               ///< as typed
};

/// A part of the window: shares of its width and height from the upper left corner.
struct WindowPart {
  double left = 0, top = 0, right = 0, bottom = 0;
  bool empty() const { return !(right > left && bottom > top); }
};

/// Builds it between Dear ImGui's frames, beside `hidden` screen coordinates of the window's left side. change: takes
/// the range that the person wants, lo below hi; null: the range cannot be chosen. Returns the area that it covers.
WindowPart show_legend(const image::Legend& legend, LegendViewState& state, double hidden,
                       const std::function<void(double lo, double hi)>& change);

}  // namespace telesplat::viewer
