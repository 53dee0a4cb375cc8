// Chance that is the same on every machine: SplitMix64 (Steele, Lea, Flood 2014), and decisions by whole numbers, sums
// and products alone.
#pragma once

#include <cstdint>
#include <vector>

namespace telesplat::simulation {

class Dice {
 public:
  explicit Dice(uint64_t seed) : state_(seed) {}

  uint64_t bits() {
    uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  /// In [0, 1).
  double unit() { return double(bits() >> 11) * 0x1p-53; }
  double between(double least, double most) { return least + (most - least) * unit(); }
  /// 0 .. count - 1. Precondition: count >= 1.
  uint64_t below(uint64_t count) { return bits() % count; }
  bool chance(double share) { return unit() < share; }
  template <class T>
  const T& pick(const std::vector<T>& of) {
    return of[below(of.size())];
  }

 private:
  uint64_t state_;
};

}  // namespace telesplat::simulation
