// Colours by height: where a ramp gave colours, a pixel's place in room space says its colour.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "common/codec/dense/kernels.h"
#include "common/codec/room_axes.h"

namespace telesplat::codec::detail {

/// A pixel of which depth and colour are known; x and y from the tile's centre.
struct HeightSample {
  float x, y, code;
  uint32_t colour;
  uint32_t place = 0;  ///< of the colour in the palette
  uint32_t index = 0;  ///< of the colour among those that are sorted by height
};

/// What may be known of where a tile's pixels look: what turns (x, y, 1) into three coordinates of room space, times
/// the depth code.
struct KnownAxes {
  const RoomAxes* axes = nullptr;  ///< null: nothing
  bool exact = false;              ///< else about so
};

/// Finds the axis of room space along which colours change least, or one that is known exactly and explains them well:
/// heights along it are (a x + b y + c) / code.
/// `first`: a pixel of each colour of the palette, in its order. Sets the samples' indices; false where no axis
/// explains the colours.
bool find_axis(const KnownAxes& known, std::vector<HeightSample>& samples, const std::vector<HeightSample>& first,
               double axis[3]);

/// The same for heights(), without knots.
bool fit_axis(const KnownAxes& known, std::vector<HeightSample>& samples, const std::vector<HeightSample>& first,
              HeightModel& model);

/// The heights of a colour's pixels.
struct ColourHeight {
  uint32_t sum = 0, pixels = 0;
  double mean() const { return static_cast<double>(sum) / std::max(pixels, 1u); }
};

/// Gives the model the knots at which indices of colours, which are sorted by their mean heights, lie.
void fit_knots(const std::vector<ColourHeight>& sorted, HeightModel& model);

/// Of a matrix, row by row; false where it has none.
bool inverse_transpose(const RoomAxes& m, RoomAxes& out);

/// The inverse of a geometry, which are axes, about; false where it has none.
bool axes_of(const GeometryModel& geometry, RoomAxes& axes);

}  // namespace telesplat::codec::detail
