// The token streams of one tile: residuals of its covered pixels in scan order, a row at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/codec/entropy.h"
#include "common/codec/predict.h"

namespace telesplat::codec::detail {

class TokenWriter {
 public:
  /// Forgets what was written; `count` residuals follow. `plain_colour`: see tile.h.
  void start(size_t count, bool plain_colour);
  /// The first n of `residuals`.
  void add(const Residuals& residuals, size_t n);
  void finish(std::vector<uint8_t>& out);

 private:
  size_t count_ = 0, done_ = 0;
  bool plain_colour_ = false;
  std::vector<uint8_t> depth_, normal_;
  std::array<std::vector<uint8_t>, 3> colour_;  // only the first unless colour is plain
  BitWriter depth_bits_, normal_bits_, colour_bits_;
};

class TokenReader {
 public:
  /// Reads the blocks of `count` residuals, of which at most `row` at a time will be taken; false where they are
  /// damaged.
  [[nodiscard]] bool start(Reader& in, size_t count, size_t row, bool plain_colour);
  /// Fills the first n of `residuals`; false where the stream is damaged.
  [[nodiscard]] bool take(JoinedRow& residuals, size_t n);
  /// All tokens and bits were taken.
  [[nodiscard]] bool finished() const;

 private:
  size_t count_ = 0, done_ = 0;
  bool plain_colour_ = false;
  std::vector<uint8_t> depth_, normal_;
  std::array<std::vector<uint8_t>, 3> colour_;
  BitReader depth_bits_, normal_bits_, colour_bits_;
};

}  // namespace telesplat::codec::detail
