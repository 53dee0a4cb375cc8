// Colours by height: where a ramp gave colours, a pixel's place in room space says its colour.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "common/codec/dense/kernels.h"

namespace telesplat::codec::detail {

/// A pixel of which depth and colour are known; x and y from the tile's centre.
struct HeightSample {
  float x, y, code;
  uint32_t colour;
  uint32_t place = 0;  ///< of the colour in the palette
  uint32_t index = 0;  ///< of the colour among those that are sorted by height
};

/// Finds the axis of room space along which colours change least, for heights(): with the knots that it sets these are
/// heights from 0 to 16383. `rays`: what turns (x, y, 1) into three coordinates times the depth code, or null.
/// `first`: a pixel of each colour of the palette, in its order. Sets the samples' indices; false where no axis
/// explains the colours.
bool fit_axis(const double rays[3][3], std::vector<HeightSample>& samples, const std::vector<HeightSample>& first,
              HeightModel& model);

/// The heights of a colour's pixels.
struct ColourHeight {
  uint32_t sum = 0, pixels = 0;
  double mean() const { return static_cast<double>(sum) / std::max(pixels, 1u); }
};

/// Gives the model the knots at which indices of colours, which are sorted by their mean heights, lie.
void fit_knots(const std::vector<ColourHeight>& sorted, HeightModel& model);

/// The inverse of a geometry, as fit_height() wants it; false where it has none.
bool rays_of(const GeometryModel& geometry, double rays[3][3]);

}  // namespace telesplat::codec::detail
