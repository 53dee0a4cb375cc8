// A plane predicted from its neighbours, weighted, and from a guide that is known: normals from those of depth's
// slopes.
#pragma once

#include <cstdint>

#include "common/codec/dense/fit.h"
#include "common/codec/dense/symbols.h"

namespace telesplat::codec::detail {

/// Values, their guide and residuals, in 64ths, or as others are configured; symbols of the residuals.
struct GuidedPlane {
  /// fraction: bits of a value below 1; most: the largest one. Six and 254: residuals are mod 256.
  static constexpr int kNormalBits = 6, kIndexBits = 4;  ///< of a value's fraction
  void reset(const TileShape& shape, int fraction = kNormalBits, int most = 254);
  int16_t nearest_value(int16_t guide) const;
  /// Borders of the guide, once its rows are known; and of the values above the first row.
  void begin(const TileShape& shape);
  /// Values of pixels that are not covered, and borders, of row y. They are the guide's.
  void finish_row(const TileShape& shape, size_t y);

  /// Chooses weights. `before`: whose residuals are known; null: none's. left: as fit_guided() has it.
  void fit(const Samples& samples, const GuidedPlane* before, const Plane<int16_t>* left = nullptr);
  /// Chooses weights; values -> symbols.
  void encode(const TileShape& shape, const Samples& samples, const GuidedPlane* before);
  /// The same once fit() was called. by_flatness: null, or by what each flatness may have weights of its own.
  void encode_fitted(const TileShape& shape, const GuidedPlane* before, const FlatSamples* by_flatness);
  void put_weights(BitSink& bits) const;
  static constexpr size_t kMostWeightBits = 16 * kGuidedTerms + 32;
  [[nodiscard]] bool get_weights(BitReader& bits);
  /// Those by flatness, after the others.
  void put_flat_weights(BitSink& bits) const;
  static constexpr size_t kMostFlatBits = kFlatnesses * kGuidedTerms * 64;
  [[nodiscard]] bool get_flat_weights(BitReader& bits);
  /// What is known of row y before its left neighbours are, into sums.
  void make_sums(const TileShape& shape, size_t y, const GuidedPlane* before);
  /// The same, and its residuals from its symbols.
  void decode_sums(const TileShape& shape, size_t y, const GuidedPlane* before);

  Plane<int16_t> values, guide, residuals;
  SymbolPlane symbols;
  int16_t weights[kGuidedTerms] = {};
  int32_t constant = 0;
  std::vector<int32_t> sums;
  int bits = 6, most = 254;
  bool median = false;  ///< predicted by the median of L, U and L + U - UL; weights are plain ones then
  const Plane<uint8_t>* flatness = nullptr;  ///< where each flatness has weights of its own
  FlatWeights flat_weights;                  ///< as they are sent,
  int16_t sets[kFlatnesses][kGuidedTerms];   ///< and added to `weights`
  bool has_residuals = false;                ///< `sums` have them, and half a unit, after decode_sums()
  bool wild = false;     ///< a row that was decoded had predictions out of bounds: others of the tile will
  double left_over = 0;  ///< after fit(): as fit_guided() has it

 private:
  int most_weight_ = 0;  ///< sum of sizes, of those that were decoded
  /// Half of L and of U: where there is nothing to be fitted.
  void set_plain_weights();
  bool has_plain_weights() const;
  void begin_row(const TileShape& shape, size_t y);
  void encode_by_median(const TileShape& shape);
  GuidedRows rows_around(size_t y, size_t begin, const GuidedPlane* before) const;
};

/// Values of row y of both planes, whose sums are known.
void decode_values(GuidedPlane& a, GuidedPlane& b, const TileShape& shape, size_t y);
void decode_values(GuidedPlane& plane, const TileShape& shape, size_t y);
/// Of normals' planes and of an index: three that need not wait for each other.
void decode_values(GuidedPlane& a, GuidedPlane& b, GuidedPlane& index, const TileShape& shape, size_t y);

}  // namespace telesplat::codec::detail
