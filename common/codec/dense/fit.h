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

/// The matrix by which slopes of `depth` become the normals' lattice vectors. x0, y0: coordinates of the tile's first
/// pixel. False where none does.
bool fit_geometry(const Samples& samples, const Plane<uint32_t>& depth, const Plane<int16_t>* const normal[2], int x0,
                  int y0, GeometryModel& model);

/// Weights for the plane `own`, whose values have so many `bits` of fraction, by least squares. residual: null, or of
/// another plane. False where there is nothing to be fitted, or where the median predictor does better: on facets,
/// whose pixels all have one normal, which no guide meets as well.
bool fit_guided(const Samples& samples, const Plane<int16_t>& own, const Plane<int16_t>& guide,
                const Plane<int16_t>* residual, int bits, int16_t weights[kGuidedTerms], int32_t& constant);

inline constexpr size_t kMostSamples = 700;  ///< of a tile: twice as many bring 0.01 to 0.03 bits

/// No sum of weights of this size leaves 32 bits.
inline constexpr int kMostWeight = 120000, kMostConstant = 1 << 27;
inline constexpr int kMostMatrix = 32767;  ///< sum of a geometry's elements' sizes

}  // namespace telesplat::codec::detail
