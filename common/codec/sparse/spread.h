// Numbers with a prediction in 16ths: their expected distance from it, and the bits of the actual one.
// Residuals of scattered pixels are nearly distributed as Student's t with 3 degrees of freedom, on rough and smooth
// surfaces alike. The width follows from known figures: how far neighbours lie, how alike they are, how large their
// errors were, and the errors of this pixel's earlier numbers. So a tile of a hundred pixels has to learn only how its
// scales differ from those of others.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "common/codec/range_coder.h"

namespace telesplat::codec::detail {

/// Eight times the logarithm to the base 2 of 1 <= v < 2^29, on lines between powers of two: 0 to 231.
constexpr int log8(uint32_t v) {
  const int exponent = std::bit_width(v) - 1;
  return 8 * exponent + static_cast<int>((v << 3 >> exponent) & 7);
}

/// Returns log8() of an error's size and a half; the error is in 16ths.
constexpr int error_log(int64_t sixteenths) {
  constexpr int64_t kMost = (1 << 28) - 8;
  return log8(static_cast<uint32_t>(std::min(sixteenths < 0 ? -sixteenths : sixteenths, kMost) + 8));
}

/// Probabilities of a number's cells around its prediction.
class SpreadShares {
 public:
  static constexpr int kMostScale = 56, kOther = 4;
  /// scale: 8 log2 of the spread in 16ths, 0 to kMostScale. rounding: distance from the lower edge of cell 0 to the
  /// prediction, 0 to 15, in 16ths of a cell.
  SpreadShares(int scale, int rounding)
      : scale_(scale), rounding_(rounding), reach_(kReach[static_cast<size_t>(scale)]) {}
  /// Places: one below all cells, cells -reach to reach, one above all.
  int places() const { return 2 * reach_ + 3; }
  int place(int64_t cell) const {
    return cell < -reach_ ? 0 : cell > reach_ ? places() - 1 : static_cast<int>(cell) + reach_ + 1;
  }
  int reach() const { return reach_; }
  /// Begin of a place, in kAll; begin(places()) is the end of the last one.
  uint32_t begin(int place) const {
    if (place == 0) return 0;
    if (place == places()) return kAll;
    const uint32_t given = 2 * static_cast<uint32_t>(places());
    return (below(place - reach_ - 1, scale_) * (kAll - given) >> kAllBits) + 2 * static_cast<uint32_t>(place);
  }
  /// Returns 256 if a wider spread makes a cell much likelier, down to -256 if much less likely.
  int wider(int place) const;

  static constexpr unsigned kAllBits = 16;
  static constexpr uint32_t kAll = 1u << kAllBits;

 private:
  static const std::array<int, kMostScale + 1> kReach;
  // Probability of numbers below the lower edge of a cell.
  uint32_t below(int cell, int scale) const;

  int scale_, rounding_, reach_;
};

/// Codes one kind of numbers of one tile.
class SpreadModel {
 public:
  static constexpr int kMostScale = 232;
  void start() { correction_ = 0, seen_ = 0; }
  /// residual: a number minus n, the whole number nearest to its prediction. rounding: the prediction minus n, in
  /// 16ths, plus 8. scale: 256 times 8 log2 of the spread in 16ths. Any bytes give some number of size below 2^50.
  template <class Coder>
  int64_t code(const Coder& coder, int64_t residual, int rounding, int scale) {
    const int at = std::clamp((scale + correction_) >> 8, 0, kMostScale);
    const int shift = at <= SpreadShares::kMostScale ? 0 : (at - SpreadShares::kMostScale + 7) / 8;
    const SpreadShares shares(at - 8 * shift, shift == 0 ? rounding : rounding >> std::min(shift, 4));
    const int64_t cell = residual >> shift;
    const int place = coder.place(shares.place(cell), shares);
    int64_t found = place - shares.reach() - 1;
    if (place == 0)
      found = -shares.reach() - 1 - static_cast<int64_t>(gamma(coder, -shares.reach() - 1 - cell));
    else if (place == shares.places() - 1)
      found = shares.reach() + 1 + static_cast<int64_t>(gamma(coder, cell - shares.reach() - 1));
    learn(shares.wider(place));
    if (shift > 0) {
      const uint32_t mask = (1u << shift) - 1;
      const uint32_t low = coder.raw(static_cast<uint32_t>(residual) & mask, static_cast<unsigned>(shift));
      return found * (int64_t{1} << shift) + low;
    }
    return found;
  }

 private:
  // Elias' gamma code of a number from 0, in raw bits; at most kMostGamma bits below its highest.
  static constexpr unsigned kMostGamma = 26;
  template <class Coder>
  static uint64_t gamma(const Coder& coder, int64_t number) {
    const auto v = static_cast<uint64_t>(number) + 1;
    const auto wanted = static_cast<unsigned>(std::bit_width(v)) - 1;
    unsigned bits = 0;
    while (bits < kMostGamma && coder.raw(bits < wanted, 1) != 0) ++bits;
    return (uint64_t{1} << bits | coder.raw(static_cast<uint32_t>(v & ((uint64_t{1} << bits) - 1)), bits)) - 1;
  }
  void learn(int wider) {
    correction_ = std::clamp(correction_ + wider * 23 / std::min(8 + seen_, 20), -kMostCorrection, kMostCorrection);
    seen_ += seen_ < 20;
  }
  static constexpr int kMostCorrection = 64 << 8;

  int correction_ = 0, seen_ = 0;
};

}  // namespace telesplat::codec::detail
