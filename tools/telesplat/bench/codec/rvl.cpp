#include "tools/telesplat/bench/codec/rvl.h"

#include <fmt/format.h>

namespace telesplat::launcher {
namespace {

class Writer {
 public:
  void number(uint32_t value) {
    do {
      const uint32_t group = value & 7;
      value >>= 3;
      nibble(uint8_t(group | (value != 0 ? 8 : 0)));
    } while (value != 0);
  }
  std::vector<uint8_t> take() { return std::move(bytes_); }

 private:
  void nibble(uint8_t n) {
    if (half_) {
      bytes_.back() = uint8_t(bytes_.back() | n);
    } else {
      bytes_.push_back(uint8_t(n << 4));
    }
    half_ = !half_;
  }
  std::vector<uint8_t> bytes_;
  bool half_ = false;
};

class Reader {
 public:
  explicit Reader(std::span<const uint8_t> bytes) : bytes_(bytes) {}
  /// False: the bytes are at their end, or the number has more than 32 bits.
  bool number(uint32_t& out) {
    out = 0;
    for (int shift = 0; shift < 33; shift += 3) {
      if (at_ / 2 >= bytes_.size()) return false;
      const uint32_t n = at_ % 2 == 0 ? bytes_[at_ / 2] >> 4 : bytes_[at_ / 2] & 15;
      ++at_;
      out |= (n & 7) << shift;
      if ((n & 8) == 0) return true;
    }
    return false;
  }
  bool at_end() const { return (at_ + 1) / 2 == bytes_.size(); }

 private:
  std::span<const uint8_t> bytes_;
  size_t at_ = 0;
};

uint32_t zigzag(uint32_t difference) { return difference << 1 ^ (0 - (difference >> 31)); }
uint32_t unzigzag(uint32_t code) { return code >> 1 ^ (0 - (code & 1)); }

}  // namespace

std::vector<uint8_t> rvl_encode(std::span<const uint32_t> values) {
  Writer out;
  uint32_t before = 0;
  for (size_t i = 0; i < values.size();) {
    size_t begin = i;
    while (i < values.size() && values[i] == 0) ++i;
    out.number(uint32_t(i - begin));
    begin = i;
    while (i < values.size() && values[i] != 0) ++i;
    out.number(uint32_t(i - begin));
    for (; begin < i; ++begin) {
      out.number(zigzag(values[begin] - before));
      before = values[begin];
    }
  }
  return out.take();
}

Result<std::vector<uint32_t>> rvl_decode(std::span<const uint8_t> bytes, size_t count) {
  Reader in(bytes);
  std::vector<uint32_t> out;
  const auto wrong = [&] { return Error{fmt::format("after {} of {} values there is no RVL", out.size(), count)}; };
  uint32_t before = 0;
  while (out.size() < count) {
    uint32_t zeros = 0, others = 0, code = 0;
    if (!in.number(zeros) || !in.number(others)) return wrong();
    if (zeros > count - out.size() || others > count - out.size() - zeros) return wrong();
    out.resize(out.size() + zeros);
    for (; others > 0; --others) {
      if (!in.number(code)) return wrong();
      out.push_back(before += unzigzag(code));
    }
  }
  if (!in.at_end()) return wrong();
  return out;
}

}  // namespace telesplat::launcher
