// Residuals as bits whose number adapts to earlier residuals: Golomb's codes (S. Golomb, 1966) with a parameter that
// adapts as in LOCO-I (M. Weinberger et al., 2000), and Elias' gamma code for much larger residuals.
//   z = zigzag-folded residual, q = z >> k.  q = 0, 1: q ones, a zero.  q >= 2: 2 + e ones, a zero, and the e bits
//   of q - 1 below its highest.  Then the lower k bits of z.
// Needs no tables, so that the headers of dense tiles, which are short, need not learn any first.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdlib>

#include "common/codec/entropy.h"

namespace telesplat::codec::detail {

/// The mean size of the residuals of one context.
class GolombContext {
 public:
  static constexpr unsigned kMostBits = 27 + 24;  ///< bits of a residual below 2^24, and of any that get() takes
  /// expected: size of the first residual.
  void start(uint32_t expected) { mean_ = std::min(expected, kMostLearned) << 8, seen_ = 0; }

  void put(int residual, BitSink& bits) {
    const uint32_t z = residual < 0 ? 2 * static_cast<uint32_t>(-residual) - 1 : 2 * static_cast<uint32_t>(residual);
    const unsigned k = parameter();
    const uint32_t q = z >> k;
    const unsigned e = q < 2 ? 0 : static_cast<unsigned>(std::bit_width(q - 1)) - 1, ones = q < 2 ? q : 2 + e;
    const uint32_t above = q < 2 ? 0 : (q - 1) & ((1u << e) - 1);
    const uint64_t rest = uint64_t{above} << k | (z & ((1u << k) - 1));
    bits.put(((uint64_t{1} << ones) - 1) | rest << (ones + 1), ones + 1 + e + k);
    learn(z);
  }
  /// Any bits give some residual of size below 2^25.
  int get(BitSource& bits) {
    const unsigned k = parameter();
    const unsigned ones = std::min(bits.ones(), 2 + kMostFoldedBits - 1 - k);  // most ones that put() writes
    bits.position += ones + 1;
    const unsigned e = ones < 2 ? 0 : ones - 2;
    const uint32_t rest = bits.take(e + k);
    const uint32_t q = ones < 2 ? ones : (1u << e | rest >> k) + 1;
    const uint32_t z = (q << k | (rest & ((1u << k) - 1))) & kMostFolded;
    learn(z);
    return static_cast<int>(z >> 1) ^ -static_cast<int>(z & 1);
  }

 private:
  static constexpr unsigned kMostFoldedBits = 25;
  static constexpr uint32_t kMostFolded = (1u << kMostFoldedBits) - 1;
  static constexpr uint32_t kMostLearned = 1u << 23;  // 256ths of more do not fit; k is 22 at most

  unsigned parameter() const {  // 2^k is 0.4 to 0.8 of the mean; more or less costs 0.5 %
    return static_cast<unsigned>(std::bit_width(static_cast<uint32_t>(uint64_t{mean_} * 102 >> 16)));
  }
  void learn(uint32_t z) {
    static constexpr uint8_t kShift[8] = {1, 2, 2, 3, 3, 3, 3, 4};
    const int64_t step = (int64_t{std::min(z, kMostLearned)} << 8) - mean_;
    mean_ = static_cast<uint32_t>(mean_ + (step >> kShift[seen_]));
    seen_ += seen_ < 7;
  }

  uint32_t mean_ = 0, seen_ = 0;  // in 256ths
};

}  // namespace telesplat::codec::detail
