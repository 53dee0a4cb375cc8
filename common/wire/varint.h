// Numbers in as few bytes as they take: seven bits a byte, the lowest ones first. Private to this library.
#pragma once

#include <cstdint>
#include <string>

#include "common/wire/limits.h"

namespace telesplat::wire {

inline constexpr unsigned kMostVarint = 9;  ///< bytes of a number: 63 bits

inline void put_varint(std::string& out, uint64_t v) {
  for (; v >= 128; v >>= 7) out.push_back(static_cast<char>(v | 128));
  out.push_back(static_cast<char>(v));
}

/// 0, -1, 1, -2, ... <-> 0, 1, 2, 3, ...
inline uint64_t fold(int64_t v) { return (static_cast<uint64_t>(v) << 1) ^ static_cast<uint64_t>(v >> 63); }
inline int64_t unfold(uint64_t v) { return static_cast<int64_t>(v >> 1) ^ -static_cast<int64_t>(v & 1); }

/// Takes numbers from bytes. It fails at the first number that is missing or too long; from then on all numbers are 0.
class VarintSource {
 public:
  explicit VarintSource(Bytes bytes) : bytes_(bytes) {}
  bool failed() const { return failed_; }
  size_t left() const { return bytes_.size(); }
  uint8_t byte() {
    failed_ = failed_ || bytes_.empty();
    if (failed_) return 0;
    const auto next = static_cast<uint8_t>(bytes_[0]);
    bytes_ = bytes_.subspan(1);
    return next;
  }
  /// most: upper limit of the number's bytes, at most kMostVarint.
  uint64_t number(unsigned most) {
    uint64_t v = 0;
    for (unsigned i = 0; i < most; ++i) {
      const uint8_t next = byte();
      v |= static_cast<uint64_t>(next & 127) << 7 * i;
      if (next < 128) return failed_ ? 0 : v;
    }
    failed_ = true;
    return 0;
  }

 private:
  Bytes bytes_;
  bool failed_ = false;
};

}  // namespace telesplat::wire
