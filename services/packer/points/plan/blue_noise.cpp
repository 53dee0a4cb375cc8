#include "services/packer/points/plan/blue_noise.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace telesplat::packer {
namespace {

constexpr int kSide = BlueNoise::kSide, kPixels = kSide * kSide;
using Ranks = std::array<uint16_t, size_t{kPixels}>;

// How crowded each pixel's surroundings are with the pixels chosen so far: a Gaussian about each, on a torus.
class Crowding {
 public:
  Crowding() {
    for (int y = -kReach; y <= kReach; ++y)
      for (int x = -kReach; x <= kReach; ++x)
        kernel_[index(x + kReach, y + kReach)] = std::exp(static_cast<float>(-(x * x + y * y)) / (2 * kSigma * kSigma));
  }
  void change(int pixel, float sign) {
    const int cx = pixel % kSide, cy = pixel / kSide;
    for (int y = -kReach; y <= kReach; ++y)
      for (int x = -kReach; x <= kReach; ++x) {
        const int at = ((cy + y) & (kSide - 1)) * kSide + ((cx + x) & (kSide - 1));
        energy_[static_cast<size_t>(at)] += sign * kernel_[index(x + kReach, y + kReach)];
      }
    chosen_[static_cast<size_t>(pixel)] = sign > 0;
  }
  void choose(int pixel) { change(pixel, 1); }
  void drop(int pixel) { change(pixel, -1); }
  /// The most crowded of the chosen pixels, the least crowded of the others. One of both must exist.
  int tightest_cluster() const {
    return best(true, [](float a, float b) { return a > b; });
  }
  int largest_void() const {
    return best(false, [](float a, float b) { return a < b; });
  }
  bool chosen(int pixel) const { return chosen_[static_cast<size_t>(pixel)]; }

 private:
  static constexpr int kReach = 8;
  static constexpr float kSigma = 1.5f;  // Ulichney's choice
  static constexpr size_t index(int x, int y) { return static_cast<size_t>(y) * (2 * kReach + 1) + x; }

  template <class Better>
  int best(bool chosen, Better better) const {
    int found = -1;
    for (int i = 0; i < kPixels; ++i)
      if (chosen_[static_cast<size_t>(i)] == chosen &&
          (found < 0 || better(energy_[static_cast<size_t>(i)], energy_[static_cast<size_t>(found)])))
        found = i;
    return found;
  }

  std::array<float, size_t{2 * kReach + 1} * (2 * kReach + 1)> kernel_;
  std::array<float, size_t{kPixels}> energy_{};
  std::array<bool, size_t{kPixels}> chosen_{};
};

Ranks void_and_cluster() {
  constexpr int kFirst = kPixels / 16;
  Crowding crowding;
  std::mt19937 random(1);  // the engine's numbers are the same everywhere
  for (int n = 0; n < kFirst;) {
    const auto pixel = static_cast<int>(random() % kPixels);
    if (crowding.chosen(pixel)) continue;
    crowding.choose(pixel);
    ++n;
  }
  // Spread the first ones: the most crowded moves to the largest void, until it would move back.
  for (int n = 0; n < kPixels; ++n) {
    const int from = crowding.tightest_cluster();
    crowding.drop(from);
    const int to = crowding.largest_void();
    crowding.choose(to);
    if (to == from) break;
  }
  Ranks ranks{};
  Crowding first = crowding;
  for (int rank = kFirst - 1; rank >= 0; --rank) {
    const int pixel = first.tightest_cluster();
    first.drop(pixel);
    ranks[static_cast<size_t>(pixel)] = static_cast<uint16_t>(rank);
  }
  for (int rank = kFirst; rank < kPixels; ++rank) {
    const int pixel = crowding.largest_void();
    crowding.choose(pixel);
    ranks[static_cast<size_t>(pixel)] = static_cast<uint16_t>(rank);
  }
  return ranks;
}

}  // namespace

const std::array<uint16_t, size_t{BlueNoise::kSide} * BlueNoise::kSide>& blue_noise_ranks() {
  static const Ranks ranks = void_and_cluster();
  return ranks;
}

// Pixels of neighbouring ranks avoid each other, so each run of ranks is spread evenly.
BlueNoise::BlueNoise(int share) : share_(std::clamp(share, 1, kMaxShare)) {
  rows_.resize(static_cast<size_t>(share_) * kSide);
  for (int i = 0; i < kPixels; ++i) {
    const auto set = static_cast<size_t>(blue_noise_ranks()[static_cast<size_t>(i)]) * static_cast<size_t>(share_) /
                     static_cast<size_t>(kPixels);
    rows_[set * kSide + static_cast<size_t>(i / kSide)] |= uint64_t{1} << (i % kSide);
  }
}

}  // namespace telesplat::packer
