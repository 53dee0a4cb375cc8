// The fit decides the bytes of a tile: compiled without contraction, like the predictions (CMakeLists.txt).
#include "common/codec/sparse/ramp.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace telesplat::codec::detail {
namespace {

// Limit of the colours' changes from one height to the next, as a share of their changes along rows.
constexpr double kMostOfRows = 0.5;

void put_i32(std::vector<uint8_t>& out, int32_t value) {
  for (int shift = 0; shift < 32; shift += 8)
    out.push_back(static_cast<uint8_t>(static_cast<uint32_t>(value) >> shift));
}

uint32_t bits_of(int distance) {
  return std::min(static_cast<uint32_t>(std::bit_width(static_cast<uint32_t>(distance) >> 3)), Ramp::kNothing - 1);
}

// Interpolates from one colour to another, `part` of `whole` of the way; rounds each channel.
uint32_t between(uint32_t from, uint32_t to, int part, int whole) {
  uint32_t out = 0;
  for (int shift = 0; shift < 24; shift += 8) {
    const int a = static_cast<int>(from >> shift & 255), b = static_cast<int>(to >> shift & 255);
    const int twice = 2 * (b - a) * part;
    out |= static_cast<uint32_t>(a + (twice + (b >= a ? whole : -whole)) / (2 * whole)) << shift;
  }
  return out;
}

double difference(uint32_t a, uint32_t b) {
  int sum = 0;
  for (int shift = 0; shift < 24; shift += 8)
    sum += std::abs(static_cast<int>(a >> shift & 255) - static_cast<int>(b >> shift & 255));
  return sum;
}

using Axis = std::array<double, 3>;

double height_of(const Axis& axis, const RampSample& s) { return (axis[0] * s.x + axis[1] * s.y + axis[2]) / s.code; }

// Sums the changes of colour from one height to the next. Sets `heights` to the samples' heights, in rising order.
double roughness(const Axis& axis, const std::vector<RampSample>& samples,
                 std::vector<std::pair<double, uint32_t>>& heights) {
  heights.clear();
  for (const RampSample& s : samples) heights.emplace_back(height_of(axis, s), s.colour);
  std::sort(heights.begin(), heights.end());
  double sum = 0;
  for (size_t i = 1; i < heights.size(); ++i) sum += difference(heights[i].second, heights[i - 1].second);
  return sum;
}

}  // namespace

std::optional<RampAxis> fit_ramp(const RoomAxes& axes, const std::vector<RampSample>& samples, int width, int height) {
  constexpr size_t kLeastSamples = 128;
  if (samples.size() < kLeastSamples) return std::nullopt;
  double by_row = 0;
  for (size_t i = 1; i < samples.size(); ++i) by_row += difference(samples[i].colour, samples[i - 1].colour);
  std::vector<std::pair<double, uint32_t>> by_height, heights;
  double least = kMostOfRows * by_row;
  Axis axis{};
  for (const Axis& candidate : axes)
    if (const double rough = roughness(candidate, samples, heights); rough < least)
      least = rough, axis = candidate, by_height = heights;
  if (by_height.empty()) return std::nullopt;
  const double low = by_height.front().first, high = by_height.back().first;
  // Uses the precision of 31 bits, and at most as many steps as there are heights.
  const double largest = std::max({std::abs(axis[0]), std::abs(axis[1]), std::abs(axis[2])});
  const double most = std::abs(axis[0]) * width + std::abs(axis[1]) * height + std::abs(axis[2]);
  if (!(largest > 0 && high > low)) return std::nullopt;
  double unit = std::ldexp(1.0, std::min(29 - std::ilogb(largest), 37 - std::ilogb(most)));
  const double steps = (high - low) * unit;
  const int shift = std::ilogb((RampAxis::kMost - 1) / steps);
  if (shift < 0) unit = std::ldexp(unit, shift);
  RampAxis out;
  out.shift = std::clamp(shift, 0, RampAxis::kMostShift);
  out.a = static_cast<int32_t>(std::lround(axis[0] * unit));
  out.b = static_cast<int32_t>(std::lround(axis[1] * unit));
  out.c = static_cast<int32_t>(std::lround(axis[2] * unit));
  const double floor = std::floor(std::ldexp(low * unit, out.shift)) - 1;
  if (!(std::abs(floor) < 2e9)) return std::nullopt;
  out.low = static_cast<int32_t>(floor);
  return out;
}

void put_ramp(std::vector<uint8_t>& out, const RampAxis& axis) {
  out.push_back(static_cast<uint8_t>(axis.shift));
  for (const int32_t value : {axis.a, axis.b, axis.c, axis.low}) put_i32(out, value);
}

std::optional<RampAxis> get_ramp(Reader& in, int width, int height) {
  const auto bytes = in.bytes(17);
  if (!bytes) return std::nullopt;
  const auto at = [&](size_t i) { return uint32_t{(*bytes)[i]}; };
  const auto i32 = [&](size_t i) {
    return static_cast<int32_t>(at(i) | at(i + 1) << 8 | at(i + 2) << 16 | at(i + 3) << 24);
  };
  const RampAxis axis{i32(1), i32(5), i32(9), i32(13), static_cast<int>(at(0))};
  const int64_t most =
      std::abs(int64_t{axis.a}) * width + std::abs(int64_t{axis.b}) * height + std::abs(int64_t{axis.c});
  if (axis.shift > RampAxis::kMostShift || most > RampAxis::kMostSum) return std::nullopt;
  return axis;
}

int Ramp::last_until(int cell) const {
  auto word = static_cast<size_t>(cell) / 64;
  uint64_t bits = taken_[word] & (~uint64_t{0} >> (63 - cell % 64));
  while (bits == 0) {
    if (word == 0) return -1;
    bits = taken_[--word];
  }
  return static_cast<int>(word * 64) + 63 - std::countl_zero(bits);
}

int Ramp::first_after(int cell) const {
  if (++cell == kCells) return -1;
  auto word = static_cast<size_t>(cell) / 64;
  uint64_t bits = taken_[word] & ~uint64_t{0} << cell % 64;
  while (bits == 0) {
    if (++word == taken_.size()) return -1;
    bits = taken_[word];
  }
  return static_cast<int>(word * 64) + std::countr_zero(bits);
}

Ramp::Said Ramp::at(int height) const {
  const int own = height >> kCellBits, lower = last_until(own);
  const Known* const below = lower < 0 ? nullptr : &known_[static_cast<size_t>(lower)];
  if (lower == own) return {below->colour, bits_of(std::abs(height - below->height))};
  const int upper = first_after(own);
  const Known* const above = upper < 0 ? nullptr : &known_[static_cast<size_t>(upper)];
  if (below == nullptr && above == nullptr) return {};
  if (below == nullptr) return {above->colour, bits_of(2 * (above->height - height))};
  if (above == nullptr) return {below->colour, bits_of(2 * (height - below->height))};
  const int whole = above->height - below->height;
  return {between(below->colour, above->colour, height - below->height, whole), bits_of(whole)};
}

}  // namespace telesplat::codec::detail
