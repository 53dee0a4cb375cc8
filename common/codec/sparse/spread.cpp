#include "common/codec/sparse/spread.h"

#include <cmath>
#include <cstdlib>
#include <numbers>

namespace telesplat::codec::detail {
namespace {

constexpr int kSpreadSteps = 16, kLast = 12 * kSpreadSteps;  // steps of a spread; the table's last step

// The distribution function at 16ths of the spread, in 2^-16. All these numbers, and those below, are more than a
// thousandth away from a half, so that all machines round alike.
const auto kBelow = [] {
  std::array<uint32_t, kLast + 2> out{};
  for (int i = 0; i <= kLast; ++i) {
    const double x = static_cast<double>(i) / kSpreadSteps;
    out[static_cast<size_t>(i)] =
        static_cast<uint32_t>(std::lround(65536 * (0.5 + (x / (1 + x * x) + std::atan(x)) / std::numbers::pi)));
  }
  out[kLast + 1] = out[kLast];
  return out;
}();

constexpr int kScales = SpreadShares::kMostScale + SpreadShares::kOther + 1;

// 2^20 / spread, by scale: 16ths of cells for i = 8 log2.
const auto kInverse = [] {
  std::array<int, kScales> out{};
  for (int i = 0; i < kScales; ++i)
    out[static_cast<size_t>(i)] = static_cast<int>(std::lround(std::exp2(20 - i / 8.0)));
  return out;
}();

}  // namespace

const std::array<int, SpreadShares::kMostScale + 1> SpreadShares::kReach = [] {
  std::array<int, kMostScale + 1> out{};
  for (int i = 0; i <= kMostScale; ++i)
    out[static_cast<size_t>(i)] = 1 + 12 * (1 << 20) / (16 * kInverse[static_cast<size_t>(i)]);
  return out;
}();

uint32_t SpreadShares::below(int cell, int scale) const {
  const int edge = 16 * cell - rounding_;
  const auto at = static_cast<uint32_t>(
      static_cast<uint64_t>(std::abs(edge)) * static_cast<uint32_t>(kInverse[static_cast<size_t>(scale)]) >> 8);
  const uint32_t step = std::min(at >> 8, static_cast<uint32_t>(kLast));
  const uint32_t part = kBelow[step] + ((kBelow[step + 1] - kBelow[step]) * (at & 255) >> 8);
  return edge < 0 ? kAll - part : part;
}

int SpreadShares::wider(int place) const {
  if (place == 0 || place + 1 == places()) return 256;
  const int cell = place - reach_ - 1;
  const auto share = [&](int scale) { return static_cast<int>(below(cell + 1, scale) - below(cell, scale)) + 1; };
  const int less = share(std::max(scale_ - kOther, 0)), more = share(scale_ + kOther);
  return (more - less) * 256 / (more + less);
}

}  // namespace telesplat::codec::detail
