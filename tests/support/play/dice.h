// Makes decisions from bytes: a fuzzer's, or a seed's. After the last byte every decision is the first choice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

namespace telesplat::test {

class Dice {
 public:
  explicit Dice(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  bool over() const { return at_ >= bytes_.size(); }
  uint8_t byte() { return over() ? 0 : bytes_[at_++]; }
  /// Returns 0 .. most - 1. Precondition: most >= 1.
  uint64_t below(uint64_t most) {
    uint64_t v = byte();
    if (most > 256) v = v << 8 | byte();
    return v % most;
  }
  bool chance(int percent) { return int(below(100)) < percent; }
  template <class C>
  auto& pick(C& of) {
    return of[below(of.size())];
  }

 private:
  std::span<const uint8_t> bytes_;
  size_t at_ = 0;
};

/// Returns the bytes of a seed.
inline std::vector<uint8_t> bytes_of_seed(uint64_t seed, size_t count) {
  std::mt19937_64 random(seed);
  std::vector<uint8_t> out(count);
  for (uint8_t& b : out) b = uint8_t(random() >> 32);
  return out;
}

}  // namespace telesplat::test
