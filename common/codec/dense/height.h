// Colours by height: where a ramp gave colours, a pixel's place in room space says its colour.
#pragma once

#include <cstdint>
#include <vector>

#include "common/codec/dense/kernels.h"

namespace telesplat::codec::detail {

/// A pixel of which depth and colour are known; x and y from the tile's centre.
struct HeightSample {
  float x, y, code;
  uint32_t colour;
  uint32_t index = 0;  ///< of the colour in the palette
};

/// Finds the axis of room space along which colours change least, and sorts the palette by it. `rays`: what turns
/// (x, y, 1) into three coordinates times the depth code. Fills the samples' indices; false where no axis explains the
/// colours. `first`: a pixel of each colour of the palette, in its order.
bool fit_height(const double rays[3][3], std::vector<HeightSample>& samples, const std::vector<HeightSample>& first,
                std::vector<uint32_t>& palette, HeightModel& model);

/// The inverse of a geometry, as fit_height() wants it; false where it has none.
bool rays_of(const GeometryModel& geometry, double rays[3][3]);

}  // namespace telesplat::codec::detail
