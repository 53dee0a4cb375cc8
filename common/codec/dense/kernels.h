// The loops over pixels, in standard C++ that compilers vectorise. Integers give the same bits on all machines.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "common/codec/dense/rans.h"

namespace telesplat::codec::detail {

/// Maps a sum of tokens to one of kContexts classes: clamp((sum - bias) >> shift) >> merges. See make_contexts().
struct ContextScale {
  int bias = 0, shift = 0, merges = 0;
};

/// Rows of tokens around those whose contexts are computed. Each may be read one element beyond both ends.
struct ContextRows {
  const uint8_t* above;   ///< the row above in the same plane
  const uint8_t* above2;  ///< the row above that
  const uint8_t* other;   ///< the same row of a plane that is already known, or null
  int sum(size_t x) const {
    const int own = 3 * above[x] + 2 * above[x - 1] + 2 * above[x + 1] + above2[x];
    return other == nullptr ? own : own + 4 * other[x] + 2 * other[x - 1] + 2 * other[x + 1];
  }
};

inline constexpr unsigned kHits = 40;  ///< eight planes, five distances: -2 to 2

/// The context of a token of planes by the kinds of the tokens above and above right, as kind above * 16 + kind above
/// right. Kinds that are followed by similar tokens share a context: 256 clusters of tokens of two isosurfaces were
/// merged to 16, always those two whose merging cost the fewest bits.
inline constexpr auto kPlaneContexts = [] {
  constexpr std::string_view kDigits =
      "0092535355ceeefe0151441444cccccc0595535356defffea59bbbbbbbbeeefe"
      "649466466677777485956b6b66defffea59bb66666beeeeea4996b6b66deffff"
      "a497666666defffea497666666defffeb497bd7ddddefffeec9eee7eeeeeffff"
      "ecfffffffffffffffcfffffffffffffffcffffffffffffffecffefffeeffffff";
  std::array<uint8_t, 256> out{};
  for (size_t i = 0; i < out.size(); ++i)
    out[i] = static_cast<uint8_t>(kDigits[i] - (kDigits[i] > '9' ? 'a' - 10 : '0'));
  return out;
}();

inline constexpr int kFeatures = 16;  ///< columns of the least-squares sums
/// Terms of guided prediction: L, U, UL, UR; the guide's 3 x 3, the fifth at the pixel's own place; the residual of
/// another plane.
inline constexpr int kGuidedTerms = 14, kGuideHere = 8, kOtherResidual = 13;

/// Rows from which a row of a plane of fixed-point values is predicted.
struct GuidedRows {
  const int16_t *own, *above;  ///< the plane's row, used to the left of the pixel, and the one above
  const int16_t* guide[3];     ///< the guide's rows above, here, below
  const int16_t* residual;     ///< the same row of another plane's residuals, or null
  const int16_t* weights;      ///< kGuidedTerms weights, in 2^-13
  int32_t constant;            ///< in 2^-13 of the plane's unit
  int bits;                    ///< bits of a value's fraction
  int32_t most;                ///< upper limit of a prediction
  bool wraps;                  ///< residuals are modulo 256
};

/// A matrix that turns slopes of depth and a height into the direction of the normal. See geometry().
struct GeometryModel {
  int16_t matrix[3][3] = {};
  int slope_shift = 0, height_shift = 0;
};

/// fold: 0, -1, 1, -2, ... -> 0, 1, 2, 3, ...
constexpr uint32_t fold(int32_t v) { return static_cast<uint32_t>(v) << 1 ^ static_cast<uint32_t>(v >> 31); }
constexpr int32_t unfold(uint32_t z) { return static_cast<int32_t>(z >> 1) ^ -static_cast<int32_t>(z & 1); }
/// The same for a difference modulo 2^24.
constexpr uint32_t fold24(uint32_t v) { return fold(static_cast<int32_t>(v << 8)) >> 8; }

/// The median of L, U and L + U - UL.
constexpr int median_of(int left, int up, int corner) {
  const int low = left < up ? left : up, high = left < up ? up : left;
  return low + high - (corner < low ? low : corner > high ? high : corner);
}

void tokens_of(const uint32_t* z, size_t n, uint8_t* tokens);
/// Contexts of n tokens.
void make_contexts(const ContextRows& rows, size_t n, ContextScale scale, uint8_t* contexts);
/// Kinds of tokens of planes: token / 5, or for a missed pixel 8 + (token - kHits) / 16, at most 15.
void plane_kinds(const uint8_t* tokens, size_t n, uint8_t* kinds);
/// z = fold(row - (left + above - above_left)) mod 2^24.
void depth_residuals(const uint32_t* above, const uint32_t* row, size_t n, uint32_t* z);
/// The same for flat and small surfaces. Tokens below kHits name which of eight planes through known pixels the pixel
/// lies in, and its distance from it; others are kHits + the token of z.
void plane_residuals(const uint32_t* above2, const uint32_t* above, const uint32_t* row, size_t n, uint32_t* z,
                     uint8_t* tokens);
/// Terms of each pixel: its depth is terms[x] + (left & take_left[x]) + ((left - one before) & take_slope[x]).
struct PlaneTerms {
  uint32_t *terms, *take_left, *take_slope;
};
void plane_terms(const uint32_t* above2, const uint32_t* above, const uint32_t* z, const uint8_t* tokens, size_t n,
                 const PlaneTerms& out);
/// Turns codes by a pole (poles.h) and returns their coordinates in 64ths; the next is the inverse.
void turn_normals(const uint16_t* codes, size_t n, int pole, int16_t* x, int16_t* y);
void turn_normals_back(const int16_t* x, const int16_t* y, size_t n, int pole, uint16_t* codes);
/// row = max(row + offset, 0) * share / 2^18, rounded down: a division by a NormalLattice's step (codec/lattice.h).
void divide(int16_t* row, size_t n, int offset, uint32_t share);
/// Unfolds numbers, times 2^bits.
void unfold_row(const uint32_t* z, size_t n, int bits, int16_t* out);
/// Sums all terms of guided prediction except L's, plus a half.
void guided_sums(const GuidedRows& rows, size_t n, int32_t* sums);
/// Folds the residuals of a row whose sums are known.
void guided_residuals(const GuidedRows& rows, const int32_t* sums, size_t n, uint32_t* z);
/// Folds the residuals from the median predictor.
void median_residuals(const GuidedRows& rows, size_t n, uint32_t* z);
/// Computes the turned octahedral coordinates, in 64ths, of the normal of the surface at each pixel. depth: rows above,
/// here and below. Columns x0 to x0 + n - 1 and the row y are counted from the tile's centre.
void geometry(const uint32_t* const depth[3], size_t n, int x0, int y, const GeometryModel& model,
              int16_t* const guide[2]);
/// Measures the variation of the guide around each pixel, as tokens.
void activity(const int16_t* const gx[3], const int16_t* const gy[3], size_t n, uint8_t* tokens);
/// Heights of n pixels: (sum + step * column) * scale / depth - low, limited to 0 to 16383, rounded down.
struct HeightScale {
  double step, scale, low;
};
void heights(const uint32_t* depth, size_t n, double sum, const HeightScale& by, int16_t* out);
/// Replaces heights by values interpolated between knots, which lie 256 heights apart.
inline constexpr size_t kKnots = 65;
void values_of_heights(const std::array<int16_t, kKnots>& knots, size_t n, int16_t* row);
/// sums[i][j] = sum of weights[s] * features[s][i] * features[s][j] over n samples, in their order.
void normal_equations(const float (*features)[kFeatures], const float* weights, size_t n, float (*sums)[kFeatures]);

}  // namespace telesplat::codec::detail
