// The legend over the window, in the panel's letters: it can be dragged elsewhere, and the range of a mesh's colours
// changed on it.
#pragma once

#include <functional>

#include "common/image/legend.h"

namespace telesplat::viewer {

/// What it keeps between frames.
struct LegendViewState {
  bool right = true, low = true;       ///< the corner that it lies nearest to
  float from_side = -1, from_end = 0;  ///< how far from it, screen coordinates; negative: it was not moved
  double lo = 0, hi = 0;               ///< as they are typed
};

/// A part of the window: shares of its width and height from the upper left corner.
struct WindowPart {
  double left = 0, top = 0, right = 0, bottom = 0;
  bool empty() const { return !(right > left && bottom > top); }
};

/// Builds it, beside `hidden` screen coordinates of the window's left side. Between Dear ImGui's frames. change: the
/// person wants this range, lo below hi; null: the range cannot be chosen. Returns what it covers.
WindowPart show_legend(const image::Legend& legend, LegendViewState& state, double hidden,
                       const std::function<void(double lo, double hi)>& change);

}  // namespace telesplat::viewer
