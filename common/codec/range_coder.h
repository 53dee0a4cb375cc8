// Range coding (G. Martin, 1979) of bits by adaptive frequencies, with carries as in I. Pavlov's LZMA.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace telesplat::codec::detail {

/// Probability that a bit is 0: the mean of two estimates that learn at different rates, both faster at first.
class AdaptiveBit {
 public:
  uint32_t zero() const { return (uint32_t{fast_} + slow_) >> 5; }  ///< in 2^-12, 2 to 4093
  void learn(uint32_t bit) {
    if (bit == 0 && fast_ == kMost && slow_ >= kSettled) return;  // another 0 would change nothing
    const int target = bit == 0 ? 65535 : 0;
    const auto towards = [&](uint16_t from, int most) {
      const int step = (target - from) * kShare[static_cast<size_t>(std::min(most, seen_ + 2))] >> 16;
      return static_cast<uint16_t>(std::clamp(from + step, 65535 - kMost, kMost));
    };
    fast_ = towards(fast_, 20), slow_ = towards(slow_, kLongest);
    seen_ = static_cast<uint16_t>(seen_ + (seen_ < kLongest));
  }

 private:
  static constexpr int kLongest = 128, kMost = 65503;
  static constexpr int kSettled = 65536 - 65536 / 512;  // from here on the slow rate's steps round to 0
  static constexpr auto kShare = [] {                   // 2^16 / n
    std::array<int, kLongest + 1> out{};
    for (int n = 2; n <= kLongest; ++n) out[static_cast<size_t>(n)] = 65536 / n;
    return out;
  }();

  uint16_t fast_ = 1u << 15, slow_ = 1u << 15, seen_ = 0;
};

/// Appends to `out`. Until finish() the caller must not change `out`.
class RangeEncoder {
 public:
  explicit RangeEncoder(std::vector<uint8_t>& out) : out_(&out), begin_(out.size()) {}
  void put(uint32_t bit, AdaptiveBit& model) {
    const uint32_t bound = (range_ >> 12) * model.zero();
    if (bit == 0) {
      range_ = bound;
    } else {
      low_ += bound, range_ -= bound;
    }
    model.learn(bit);
    while (range_ < 1u << 24) range_ <<= 8, shift();
  }
  /// Puts bits without a model, the highest first.
  void put_raw(uint32_t value, unsigned count) {
    while (count-- > 0) {
      range_ >>= 1;
      if (value >> count & 1) low_ += range_;
      while (range_ < 1u << 24) range_ <<= 8, shift();
    }
  }
  /// Puts one of several symbols that share [0, 2^16): its interval begins at `begin` and has `size`.
  void put_share(uint32_t begin, uint32_t size) {
    const uint32_t unit = range_ >> 16;
    low_ += uint64_t{unit} * begin, range_ = unit * size;
    while (range_ < 1u << 24) range_ <<= 8, shift();
  }
  /// Writes the fewest bytes with the same meaning; the decoder reads zeros after them.
  void finish() {
    for (int zeros = 32; zeros >= 0; --zeros) {
      const uint64_t unit = uint64_t{1} << zeros, number = (low_ + unit - 1) & ~(unit - 1);
      if (number >= low_ + range_) continue;
      low_ = number;
      break;
    }
    for (int i = 0; i < 5; ++i) shift();
    while (out_->size() > begin_ && out_->back() == 0) out_->pop_back();
  }

 private:
  void shift() {
    if (low_ < 0xFF000000u || low_ > 0xFFFFFFFFu) {
      const auto carry = static_cast<uint8_t>(low_ >> 32);
      if (any_) out_->push_back(static_cast<uint8_t>(cache_ + carry));
      for (; held_ != 0; --held_) out_->push_back(static_cast<uint8_t>(0xFF + carry));
      cache_ = static_cast<uint8_t>(low_ >> 24), any_ = true;
    } else {
      ++held_;
    }
    low_ = (low_ & 0x00FFFFFF) << 8;
  }

  std::vector<uint8_t>* out_;
  size_t begin_;
  uint64_t low_ = 0;
  uint32_t range_ = ~0u;
  uint8_t cache_ = 0;
  bool any_ = false;
  size_t held_ = 0;
};

/// Reads endless zeros past the end of its bytes: callers must bound the number of bits.
class RangeDecoder {
 public:
  explicit RangeDecoder(std::span<const uint8_t> bytes = {}) : bytes_(bytes) {
    for (int i = 0; i < 4; ++i) code_ = code_ << 8 | next();
  }
  uint32_t get(AdaptiveBit& model) {
    const uint32_t bound = (range_ >> 12) * model.zero();
    const uint32_t bit = code_ >= bound;
    if (bit == 0) {
      range_ = bound;
    } else {
      code_ -= bound, range_ -= bound;
    }
    model.learn(bit);
    for (; range_ < 1u << 24; range_ <<= 8) code_ = code_ << 8 | next();
    return bit;
  }
  uint32_t get_raw(unsigned count) {
    uint32_t value = 0;
    while (count-- > 0) {
      range_ >>= 1;
      const uint32_t bit = code_ >= range_;
      if (bit != 0) code_ -= range_;
      value = value << 1 | bit;
      for (; range_ < 1u << 24; range_ <<= 8) code_ = code_ << 8 | next();
    }
    return value;
  }
  /// Returns a number below 2^16 in the interval that put_share() got; the caller passes that interval to take_share().
  uint32_t share() const { return std::min(code_ / (range_ >> 16), 65535u); }
  void take_share(uint32_t begin, uint32_t size) {
    const uint32_t unit = range_ >> 16;
    code_ -= unit * begin, range_ = unit * size;
    for (; range_ < 1u << 24; range_ <<= 8) code_ = code_ << 8 | next();
  }
  /// True if all bytes were read.
  bool finished() const { return at_ == bytes_.size(); }

 private:
  uint8_t next() { return at_ < bytes_.size() ? bytes_[at_++] : uint8_t{0}; }

  std::span<const uint8_t> bytes_;
  size_t at_ = 0;
  uint32_t range_ = ~0u, code_ = 0;
};

/// Common interface of both directions: puts or gets a bit, or raw bits; each call returns the value.
struct BitCoder {
  RangeEncoder& coder;
  uint32_t operator()(uint32_t bit, AdaptiveBit& model) const { return coder.put(bit, model), bit; }
  uint32_t raw(uint32_t value, unsigned count) const { return coder.put_raw(value, count), value; }
  template <class Shares>
  int place(int place, const Shares& shares) const {
    const uint32_t begin = shares.begin(place);
    return coder.put_share(begin, shares.begin(place + 1) - begin), place;
  }
};
struct BitDecoder {
  RangeDecoder& coder;
  uint32_t operator()(uint32_t, AdaptiveBit& model) const { return coder.get(model); }
  uint32_t raw(uint32_t, unsigned count) const { return coder.get_raw(count); }
  /// Shares: begin(place) in [0, 2^16] for 0 <= place <= places(), rising.
  template <class Shares>
  int place(int, const Shares& shares) const {
    const uint32_t share = coder.share();
    int low = 0, high = shares.places();
    while (high - low > 1) {
      const int middle = (low + high) / 2;
      (shares.begin(middle) <= share ? low : high) = middle;
    }
    const uint32_t begin = shares.begin(low);
    return coder.take_share(begin, shares.begin(low + 1) - begin), low;
  }
};

/// A signed number: its size's length in unary bits, its sign, the two bits below the highest, then the rest raw.
class SignedModel {
 public:
  static constexpr unsigned kMostBits = 9;  ///< bits of its size
  /// sign: 0 to 2, index of the model for the sign.
  template <class Coder>
  int code(const Coder& coder, int value, size_t sign) {
    const unsigned size_is = value < 0 ? 0u - static_cast<unsigned>(value) : static_cast<unsigned>(value);
    const auto wanted = static_cast<unsigned>(std::bit_width(size_is));
    unsigned bits = 0;
    while (bits < kMostBits && coder(bits < wanted, more_[bits]) != 0) ++bits;
    if (bits == 0) return 0;
    const uint32_t negative = coder(value < 0, sign_[sign]);
    uint32_t size = 1;
    if (bits >= 2) size = size << 1 | coder(size_is >> (bits - 2) & 1, below_[bits][1]);
    if (bits >= 3) size = size << 1 | coder(size_is >> (bits - 3) & 1, below_[bits][size]);
    if (bits > 3) size = size << (bits - 3) | coder.raw(size_is & ((1u << (bits - 3)) - 1), bits - 3);
    return negative != 0 ? -static_cast<int>(size) : static_cast<int>(size);
  }

 private:
  std::array<AdaptiveBit, kMostBits> more_;
  std::array<AdaptiveBit, 3> sign_;
  std::array<std::array<AdaptiveBit, 4>, kMostBits + 1> below_;
};

}  // namespace telesplat::codec::detail
