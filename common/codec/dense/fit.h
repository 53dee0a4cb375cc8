// What an encoder fits to a tile: the geometry of its normals, and weights of predictions.
// In floating point: what is fitted is sent, so that only encoders do it.
#pragma once

#include <vector>

#include "common/codec/dense/kernels.h"
#include "common/codec/dense/symbols.h"

namespace telesplat::codec::detail {

/// Pixels of a tile that stand for all: covered, with covered neighbours.
struct Samples {
  struct Place {
    int x, y;
  };
  std::vector<Place> places;
  void choose(const TileShape& shape, size_t about);
};

/// Finds the integers that stand for a matrix, row by row, by which slopes of `depth` become the normals' lattice
/// vectors. x0, y0: coordinates of the tile's first pixel. Returns false if normals do not follow it.
bool fit_geometry(const Samples& samples, const Plane<uint32_t>& depth, const Plane<int16_t>* const normal[2], int x0,
                  int y0, const double matrix[9], GeometryModel& model);

/// A plane of fixed-point values and what predicts it.
struct GuidedSamples {
  const Samples& samples;
  const Plane<int16_t>&values, &guide;
  const Plane<int16_t>* residuals;  ///< of another plane, or null
  int bits;                         ///< of the values' fraction
};

/// Weights found by least squares.
struct GuidedFit {
  bool better_than_median =
      false;  ///< else weights are 0: on facets, whose pixels all have one normal, the median wins
  int16_t weights[kGuidedTerms] = {};
  int32_t constant = 0;
  double left_over = 0;  ///< mean token of what is left; infinite if nothing could be fitted
};
GuidedFit fit_guided(const GuidedSamples& of);

inline constexpr size_t kMostSamples = 450;  ///< of a tile: 700 bring 0.01 to 0.04 bits

/// No sum of weights of this size leaves 32 bits.
inline constexpr int kMostWeight = 120000, kMostConstant = 1 << 27;
inline constexpr int kMostMatrix = 32767;  ///< sum of a geometry's elements' sizes

}  // namespace telesplat::codec::detail
