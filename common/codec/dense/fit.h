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

/// The same of a matrix that is known, row by row; false where normals do not follow it.
bool known_geometry(const Samples& samples, const Plane<uint32_t>& depth, const Plane<int16_t>* const normal[2], int x0,
                    int y0, const double matrix[9], GeometryModel& model);

/// Weights for the plane `own`, whose values have so many `bits` of fraction, by least squares. residual: null, or of
/// another plane. False where there is nothing to be fitted, or where the median predictor does better: on facets,
/// whose pixels all have one normal, which no guide meets as well. left: null, or another plane of which the left
/// neighbour is; the median predicts nothing then. left_over: the mean token of what is left; infinite if that
/// is not known, as of a plane that has a left neighbour of its own.
bool fit_guided(const Samples& samples, const Plane<int16_t>& own, const Plane<int16_t>& guide,
                const Plane<int16_t>* residual, int bits, int16_t weights[kGuidedTerms], int32_t& constant,
                const Plane<int16_t>* left, double& left_over);

/// What weights by flatness are fitted to: more samples, since each flatness needs enough.
struct FlatSamples {
  Samples samples;
  const Plane<uint8_t>* flatness = nullptr;
};

/// Weights of each flatness, as differences in 2^-6 to those of all, -kMostFlat to kMostFlat. The guide at the pixel
/// itself has none: its weight makes up for all others but the residual's.
struct FlatWeights {
  int16_t off[kFlatnesses][kGuidedTerms];
};
inline constexpr int kMostFlat = 500;

/// The sums of both; false where one is too large.
[[nodiscard]] bool add_flat_weights(const int16_t weights[kGuidedTerms], const FlatWeights& flat,
                                    int16_t out[kFlatnesses][kGuidedTerms]);

/// Weights by flatness for the plane `own` of 64ths, which `weights` and `constant` predict without them, or the median
/// does. False where they do not save what it takes to send them. pixels: how many are coded.
bool fit_flat_weights(const FlatSamples& by, const Plane<int16_t>& own, const Plane<int16_t>& guide,
                      const Plane<int16_t>* residual, const int16_t weights[kGuidedTerms], int32_t constant,
                      bool median, size_t pixels, FlatWeights& out);

inline constexpr size_t kMostSamples = 450;      ///< of normals of a tile: 700 bring 0.01 to 0.04 bits
inline constexpr size_t kMostFlatSamples = 900;  ///< of a tile: 1300 bring 0.04 bits of an isosurface

/// No sum of weights of this size leaves 32 bits.
inline constexpr int kMostWeight = 120000, kMostConstant = 1 << 27;
inline constexpr int kMostMatrix = 32767;  ///< sum of a geometry's elements' sizes

}  // namespace telesplat::codec::detail
