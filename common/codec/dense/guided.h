// A plane predicted by weights from its neighbours and from a known guide: normals from those of depth's slopes,
// colours from those around.
#pragma once

#include <cstdint>

#include "common/codec/dense/fit.h"
#include "common/codec/dense/symbols.h"

namespace telesplat::codec::detail {

/// Values, their guide and residuals as fixed-point numbers; symbols of the residuals.
struct GuidedPlane {
  /// Bits of a value's fraction. Values with kByteBits have residuals modulo 256; those with kIndexBits go to 1023.
  static constexpr int kByteBits = 6, kIndexBits = 4;
  /// largest: upper limit of the values.
  void reset(const TileShape& shape, int fraction, int largest);
  int16_t nearest_value(int16_t guide) const;
  /// Sets borders of the guide, once its rows are known, and the values above the first row.
  void begin(const TileShape& shape);
  /// Sets pixels of row y that are not covered, and borders, to the guide's values.
  void finish_row(const TileShape& shape, size_t y);

  /// Chooses weights once all values are known. before: a plane whose residuals are known, or null. Returns the mean
  /// token of the prediction errors, infinite if no fit was possible.
  double fit(const Samples& samples, const GuidedPlane* before);
  /// values -> symbols, after fit().
  void encode(const TileShape& shape, const GuidedPlane* before);
  void put_weights(BitSink& bits) const;
  static constexpr size_t kMostWeightBits = 16 * kGuidedTerms + 32;
  [[nodiscard]] bool get_weights(BitReader& bits);
  /// Makes residuals of row y from its symbols, and the terms of the prediction that do not need left neighbours.
  void decode_sums(const TileShape& shape, size_t y, const GuidedPlane* before);

  Plane<int16_t> values, guide, residuals;
  SymbolPlane symbols;
  int16_t weights[kGuidedTerms] = {};
  int32_t constant = 0;
  std::vector<int32_t> sums;
  int bits = kByteBits, most = 254;
  bool median = false;  ///< predicted by the median of L, U and L + U - UL, without weights

 private:
  GuidedRows rows_around(size_t y, const GuidedPlane* before) const;
};

/// Decodes values of row y, whose sums are known, of one plane or of two or three that are independent.
void decode_values(GuidedPlane& plane, const TileShape& shape, size_t y);
void decode_values(GuidedPlane& a, GuidedPlane& b, const TileShape& shape, size_t y);

}  // namespace telesplat::codec::detail
