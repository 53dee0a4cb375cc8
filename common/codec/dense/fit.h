// Fits of an encoder to a tile: the geometry of its normals, and weights of predictions. In floating point: decoders do
// not fit, since the results are sent.
#pragma once

#include <vector>

#include "common/codec/dense/kernels.h"
#include "common/codec/dense/symbols.h"

namespace telesplat::codec::detail {

/// Pixels that represent a tile: covered, with covered neighbours.
struct Samples {
  struct Place {
    int x, y;
  };
  std::vector<Place> places;
  void choose(const TileShape& shape, size_t about);
};

/// Finds the integers that represent `matrix`, which turns slopes of `depth` into the normals' lattice vectors, row by
/// row. Returns false if normals do not follow it.
bool fit_geometry(const Samples& samples, const TileShape& shape, const Plane<uint32_t>& depth,
                  const Plane<int16_t>* const normal[2], const double matrix[9], GeometryModel& model);

/// A plane of fixed-point values and the planes that predict it.
struct GuidedSamples {
  const Samples& samples;
  const Plane<int16_t>&values, &guide;
  const Plane<int16_t>* residuals;  ///< residuals of another plane, or null
  int bits;                         ///< bits of the values' fraction
};

/// Weights found by least squares.
struct GuidedFit {
  bool better_than_median =
      false;  ///< if false, weights are 0: on facets, whose pixels all have one normal, the median wins
  int16_t weights[kGuidedTerms] = {};
  int32_t constant = 0;
  double left_over = 0;  ///< mean token of the prediction errors; infinite if no fit was possible
};
GuidedFit fit_guided(const GuidedSamples& of);

inline constexpr size_t kMostSamples = 450;  ///< samples of a tile: 700 gain 0.01 to 0.04 bits

/// Sums with weights of at most this size fit 32 bits.
inline constexpr int kMostWeight = 120000, kMostConstant = 1 << 27;
inline constexpr int kMostMatrix = 32767;  ///< sum of the absolute values of a geometry's elements

}  // namespace telesplat::codec::detail
