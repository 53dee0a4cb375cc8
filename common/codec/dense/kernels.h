// The loops over pixels and symbols, of which there is one set for each instruction set, and a plain one.
// All sets give the same results to the bit: integers only. The plain set is standard C++20 and needs nothing else.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/codec/dense/rans.h"

namespace telesplat::codec::detail {

/// How a sum of tokens becomes one of kContexts classes: clamp((sum - bias) >> shift) >> merges. See contexts().
struct ContextScale {
  int bias = 0, shift = 0, merges = 0;
};

/// Rows of tokens around those whose contexts are wanted. Each may be read one element beyond both ends.
struct ContextRows {
  const uint8_t* above;   ///< of the same plane
  const uint8_t* above2;  ///< the row above that
  const uint8_t* other;   ///< of the same row of what is already known; null: nothing is
};

inline constexpr unsigned kHits = 40;  ///< eight planes, five distances: -2 to 2

/// The context of a token of planes by the kinds of those above and above right, as kind above * 16 + kind above right.
/// Kinds that are followed by similar tokens share a context: 256 clusters of tokens of two isosurfaces were merged to
/// 16, always those two whose merging cost the fewest bits.
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

inline constexpr int kFeatures = 16;  ///< of what least squares sum up
/// Of guided prediction: L, U, UL, UR; 9 of the guide; another residual; LL, UU, which weigh nothing but by flatness.
inline constexpr int kGuidedTerms = 16, kGuideHere = 8, kOtherResidual = 13, kFarLeft = 14, kFarAbove = 15;
/// Classes of pixels by what of their depth continues that of those before: 1 the plane of L, U and UL, 2 the line of
/// L and LL, 4 the line of U and UU.
inline constexpr int kFlatnesses = 8;

/// What predicts a row of a plane of 64ths: its own rows, a guide, and residuals that are known.
struct GuidedRows {
  const int16_t *own, *above, *above2;     ///< the plane's row, of which what is to the left is used, and those above
  const int16_t* guide[3];                 ///< the guide's rows above, here, below
  const int16_t* residual;                 ///< of another plane's same row, in 64ths; null: none
  const int16_t* own_residual;             ///< of the plane itself, which weigh 1; null: they are not added
  const uint8_t* flatness;                 ///< of the row's pixels; null: of all it is 0, and LL and UU weigh nothing
  const int16_t (*weights)[kGuidedTerms];  ///< in 2^-13, of each flatness: L, U, UL, UR; the guide's 3 x 3; ...
  int32_t constant;                        ///< in 2^-13 of the plane's unit
  int bits = 6;                            ///< of a value's fraction: what 64ths have
  int32_t most = 254;                      ///< the largest value that is predicted
};

/// Where a plane of room space cuts a pixel's ray: ((a x + b y + c - base code) / code - low) * scale, code being the
/// depth code, and what a table of kKnots points makes of it. The sum is one modulo 2^32. See docs/codec.md.
struct HeightModel {
  static constexpr int kKnots = 65;
  int32_t a = 0, b = 0, c = 0, base = 0;
  int32_t low = 0, scale = 0;
  int16_t knots[kKnots] = {};
};

/// A matrix that turns what depth says of a surface into the direction of its normal. See geometry().
struct GeometryModel {
  int16_t matrix[3][3] = {};
  int slope_shift = 0, height_shift = 0;
};

inline constexpr size_t kMoreSlots = 16;  ///< entries that vectors write beyond the end

struct Kernels {
  /// Bit x of `words` = depth[x] != 0; bits at and beyond n of the last word are 0.
  void (*covered_bits)(const uint32_t* depth, size_t n, uint64_t* words);
  /// `words` as bytes, 255 and 0, which others take as `cover`: null stands for 255 everywhere.
  void (*cover_bytes)(const uint64_t* words, size_t n, uint8_t* cover);
  /// to = from where pixels are covered, else 0. Both may be the same.
  void (*cut_wide)(const uint8_t* cover, const uint32_t* from, size_t n, uint32_t* to);
  void (*cut_short)(const uint8_t* cover, const uint16_t* from, size_t n, uint16_t* to);
  /// Those of n elements whose bits of `words` are set, one after the other. Up to 64 more are read and written.
  void (*pack_bytes)(const uint64_t* words, const uint8_t* from, size_t n, uint8_t* to);
  void (*pack_shorts)(const uint64_t* words, const uint16_t* from, size_t n, uint16_t* to);
  void (*pack_wide)(const uint64_t* words, const uint32_t* from, size_t n, uint32_t* to);
  /// The inverse. Bytes whose bits are not set may become anything.
  void (*unpack_bytes)(const uint64_t* words, const uint8_t* from, size_t n, uint8_t* to);
  /// cover: the same as `words`. Others become 0.
  void (*unpack_wide)(const uint64_t* words, const uint8_t* cover, const uint32_t* from, size_t n, uint32_t* to);
  /// Pixels that are not covered become those of `from`.
  void (*keep_bytes)(const uint8_t* cover, const uint8_t* from, size_t n, uint8_t* row);
  /// Those that are not covered, of all with null, become the values nearest to the guide.
  void (*fill_values)(const uint8_t* cover, const int16_t* guide, size_t n, int bits, int most, int16_t* row);
  /// Whether all values of pixels that are covered are at most `most`, and less their residuals at most `most_guess`;
  /// and none of these is negative. most and most_guess: below 2^15.
  bool (*within)(const uint8_t* cover, const int16_t* values, const int16_t* residuals, size_t n, int most_guess,
                 int most);
  /// The largest number less 1, modulo 2^32, of pixels that are covered.
  uint32_t (*largest_less_one)(const uint8_t* cover, const uint32_t* row, size_t n);
  /// z = fold(row - (left + above - above_left)) mod 2^24 and its tokens.
  void (*depth_residuals)(const uint32_t* above, const uint32_t* row, size_t n, uint32_t* z, uint8_t* tokens);
  /// The inverse: row from z; row[-1] and above[-1] are known. All mod 2^24.
  void (*depth_rows)(const uint32_t* above, const uint32_t* z, size_t n, uint32_t* row);
  /// The same where surfaces are flat and small: tokens below kHits say in which of eight planes through known pixels
  /// a pixel lies, and how far off; others are kHits + those of z.
  void (*plane_residuals)(const uint32_t* above2, const uint32_t* above, const uint32_t* row, size_t n, uint32_t* z,
                          uint8_t* tokens);
  /// What each pixel of a row is: terms[x] + (left & take_left[x]) + (left - the one before & take_slope[x]). Those
  /// that are not covered lie in the plane of L, U and UL.
  void (*plane_terms)(const uint32_t* above2, const uint32_t* above, const uint32_t* z, const uint8_t* tokens,
                      const uint8_t* cover, size_t n, uint32_t* terms, uint32_t* take_left, uint32_t* take_slope);
  /// The kinds of such tokens: token / 5, or by how large what is missed is 8 + (token - kHits) / 16, at most 15.
  void (*plane_kinds)(const uint8_t* tokens, size_t n, uint8_t* kinds);
  /// Contexts of n such tokens from the kinds above, of which there are n + 1: those of kPlaneContexts >> merges.
  void (*plane_contexts)(const uint8_t* above, size_t n, int merges, uint8_t* contexts);
  /// Contexts of n tokens.
  void (*contexts)(const ContextRows& rows, size_t n, ContextScale scale, uint8_t* contexts);
  /// low + 256 high.
  void (*join_bytes)(const uint8_t* low, const uint8_t* high, size_t n, uint16_t* out);
  /// 0 if all of n normals that are covered are canonical (image/normal.h).
  uint32_t (*other_normals)(const uint8_t* cover, const uint16_t* codes, size_t n);
  /// Coordinates in 64ths of codes that are turned by pole 0 to 5 (docs/codec.md), and the inverse.
  void (*turn_normals)(const uint16_t* codes, size_t n, int pole, int16_t* x, int16_t* y);
  void (*turn_normals_back)(const int16_t* x, const int16_t* y, size_t n, int pole, uint16_t* codes);
  /// row = max(row + offset, 0) * share / 2^18, rounded down: a division by a NormalLattice's step (codec/lattice.h).
  void (*divide)(int16_t* row, size_t n, int offset, uint32_t share);
  /// Bytes that were folded -> 64ths of -128..127.
  void (*unfold_bytes)(const uint8_t* z, size_t n, int16_t* out);
  /// The same of larger numbers, times 2^bits.
  void (*unfold_wide)(const uint32_t* z, size_t n, int bits, int16_t* out);
  /// Residuals of bytes by the median predictor, folded, and their tokens.
  void (*median_residuals)(const uint8_t* above, const uint8_t* row, size_t n, uint8_t* z, uint8_t* tokens);
  /// Residuals of a plane of 64ths by guided prediction, folded mod 256, their tokens; and as 64ths of -128..127.
  void (*guided_residuals)(const GuidedRows& rows, size_t n, uint8_t* z, uint8_t* tokens, int16_t* residual);
  /// The same for values that take more than a byte: not mod 256.
  void (*guided_residuals_wide)(const GuidedRows& rows, size_t n, uint32_t* z, uint8_t* tokens, int16_t* residual);
  /// The same as guided_residuals() by the median of L, U and L + U - UL.
  void (*median_values)(const int16_t* above, const int16_t* row, size_t n, uint8_t* z, uint8_t* tokens,
                        int16_t* residual);
  /// All terms of guided prediction but those of L and LL; with_left, which needs a flatness and no residuals of the
  /// plane itself: these too.
  void (*guided_sums)(const GuidedRows& rows, size_t n, int32_t* sums, bool with_left);
  /// Flatness of each pixel of `row`: depth differs by less than `limit`, a power of two, from what continues it.
  void (*flatness)(const uint32_t* above2, const uint32_t* above, const uint32_t* row, size_t n, uint32_t limit,
                   uint8_t* out);
  /// The turned octahedral coordinates, in 64ths, of the surface through each depth: rows above, here and below.
  /// Columns x0 to x0 + n - 1 and the row y, from the tile's centre, fit into 16 bits.
  void (*geometry)(const uint32_t* const depth[3], size_t n, int x0, int y, const GeometryModel& model, int16_t* gx,
                   int16_t* gy);
  /// Heights in 2^-8 of a knot, 0 to 16383. model.knots is not looked at.
  void (*heights)(const uint32_t* depth, size_t n, int x0, int y, const HeightModel& model, int16_t* out);
  /// Heights -> the indices that they stand for, in 16ths.
  void (*knots)(const HeightModel& model, size_t n, int16_t* row);
  /// How much the guide varies around each pixel, as tokens.
  void (*activity)(const int16_t* const gx[3], const int16_t* const gy[3], size_t n, uint8_t* tokens);
  /// sums[i][j] = sum of weights[s] * features[s][i] * features[s][j] over n samples, in their order; for j <= i.
  void (*normal_equations)(const float (*features)[kFeatures], const float* weights, size_t n,
                           float (*sums)[kFeatures]);
  /// shares[s] = 1 / (least + |sum of terms * features[s]|), or of its square; up to the next multiple of four. The sum
  /// is (a + b) + (c + d), where a adds up every fourth product from the first on, b from the second on, ...
  void (*sample_shares)(const float (*features)[kFeatures], const float* terms, size_t n, float least, bool squared,
                        float* shares);
  /// The entries of make_decode_tables() of one context; returns their end. Writes up to kMoreSlots entries more.
  uint32_t* (*slots)(const uint16_t* frequencies, unsigned alphabet, uint32_t* out);
  /// Appends the row's symbols, the last one first, at `out`, which must have room for 6 bytes a symbol and 64 more.
  uint8_t* (*put_symbols)(const SymbolRow& row, const EncodeEntry* tables, uint32_t* states, uint8_t* out);
  /// Takes symbols from the bytes [begin, end), the last ones first; returns what is left of them, or null where
  /// they are too few. 64 bytes at `end` must be readable.
  const uint8_t* (*get_symbols)(const DecodedRow& row, const uint32_t* tables, uint32_t* states, const uint8_t* begin,
                                const uint8_t* end);
};

/// The fastest set for this machine.
const Kernels& kernels();
/// Standard C++ alone.
const Kernels& plain_kernels();
/// The instruction sets that there are kernels for and that this machine has, as Highway numbers them, the fastest
/// first; none where the plain set is the only one.
std::vector<int64_t> kernel_targets();

}  // namespace telesplat::codec::detail
