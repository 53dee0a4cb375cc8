#include "services/data/volume/statistics.h"

#include <fmt/format.h>
#include <tbb/combinable.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/parallel/in_parallel.h"

namespace telesplat::data {
namespace {

constexpr double kMaxValue = volume::kMaxTransferValue;

bool is_byte(VoxelType type) { return type == VoxelType::kU8 || type == VoxelType::kI8; }

// Calls body(level of voxel n, n) for n in [begin, end).
template <class Body>
class LevelOf {
 public:
  LevelOf(const Volume& volume, const volume::Levels& levels, const std::vector<uint16_t>& table)
      : volume_(volume), levels_(levels), table_(table) {}

  void each(size_t begin, size_t end, const Body& body) const {
    const std::byte* const stored = volume_.stored.data();
    if (volume_.type == VoxelType::kF32) {
      for (size_t n = begin; n < end; ++n) {
        float value;
        std::memcpy(&value, stored + n * sizeof value, sizeof value);
        body(std::isfinite(value) ? levels_.level(double(value) * volume_.scale + volume_.offset) : uint16_t(0), n);
      }
    } else if (is_byte(volume_.type)) {
      for (size_t n = begin; n < end; ++n) body(table_[std::to_integer<uint8_t>(stored[n])], n);
    } else {
      for (size_t n = begin; n < end; ++n) {
        uint16_t bits;
        std::memcpy(&bits, stored + n * sizeof bits, sizeof bits);
        body(table_[bits], n);
      }
    }
  }

 private:
  const Volume& volume_;
  const volume::Levels& levels_;
  const std::vector<uint16_t>& table_;
};

// The levels of all bit patterns of an integer type; empty for floats.
std::vector<uint16_t> level_table(const Volume& volume, const volume::Levels& levels) {
  if (volume.type == VoxelType::kF32) return {};

  std::vector<uint16_t> out(is_byte(volume.type) ? 256 : 65536);
  for (size_t bits = 0; bits < out.size(); ++bits) {
    double stored = double(bits);
    if (volume.type == VoxelType::kI8) stored = int8_t(bits);
    if (volume.type == VoxelType::kI16) stored = int16_t(bits);
    out[bits] = levels.level(stored * volume.scale + volume.offset);
  }
  return out;
}

template <class Body>
void each_level(const Volume& volume, const volume::Levels& levels, const std::vector<uint16_t>& table, size_t begin,
                size_t end, const Body& body) {
  LevelOf<Body>(volume, levels, table).each(begin, end, body);
}

size_t voxels_a_slice(const Volume& volume) { return size_t(volume.size[0]) * size_t(volume.size[1]); }

}  // namespace

Result<volume::Levels> choose_levels(const Volume& v, double lo, double hi) {
  if (!(std::abs(lo) <= kMaxValue && std::abs(hi) <= kMaxValue))
    return Error{fmt::format("values from {} to {}, limit {}", lo, hi, kMaxValue)};
  if (!std::isfinite(v.scale) || std::abs(v.scale) < 1 / kMaxValue || std::abs(v.scale) > kMaxValue ||
      !(std::abs(v.offset) <= kMaxValue))
    return Error{fmt::format("values are scaled by {} and moved by {}", v.scale, v.offset)};
  const double step = std::abs(v.scale);
  if (is_byte(v.type)) {
    const double first = v.type == VoxelType::kI8 ? -128 : 0, last = first + 255;
    return volume::Levels{(v.scale > 0 ? first : last) * v.scale + v.offset, step, 256};
  }
  if (v.type != VoxelType::kF32)
    if (const double last = std::round((hi - lo) / step); last < volume::kMaxLevels)
      return volume::Levels{lo, step, int(last) + 1};
  const double fine = (hi - lo) / (volume::kMaxLevels - 1);
  if (fine < 1 / kMaxValue) return volume::Levels{lo, 1, 1};
  return volume::Levels{lo, fine, volume::kMaxLevels};
}

LevelArray to_levels(const Volume& v, const volume::Levels& levels, int k_begin, int k_end) {
  const auto table = level_table(v, levels);
  const size_t slice = voxels_a_slice(v), first = size_t(k_begin) * slice;
  LevelArray out;
  const bool narrow = levels.count <= 256;
  narrow ? out.narrow.resize(size_t(k_end - k_begin) * slice) : out.wide.resize(size_t(k_end - k_begin) * slice);
  in_parallel(k_begin, k_end, [&](int k) {
    const size_t begin = size_t(k) * slice, end = begin + slice;
    if (narrow)
      each_level(v, levels, table, begin, end, [&](uint16_t l, size_t n) { out.narrow[n - first] = uint8_t(l); });
    else
      each_level(v, levels, table, begin, end, [&](uint16_t l, size_t n) { out.wide[n - first] = l; });
  });
  return out;
}

std::vector<uint64_t> count_levels(const Volume& v, const volume::Levels& levels) {
  const auto table = level_table(v, levels);
  const size_t slice = voxels_a_slice(v);
  tbb::combinable<std::vector<uint64_t>> counts([&] { return std::vector<uint64_t>(size_t(levels.count)); });
  in_parallel(0, v.size[2], [&](int k) {
    auto& mine = counts.local();
    each_level(v, levels, table, size_t(k) * slice, size_t(k + 1) * slice, [&](uint16_t l, size_t) { ++mine[l]; });
  });
  std::vector<uint64_t> out(size_t(levels.count));
  counts.combine_each([&](const auto& mine) {
    for (size_t l = 0; l < out.size(); ++l) out[l] += mine[l];
  });
  return out;
}

volume::ValueRange describe_values(const std::vector<uint64_t>& counts, const volume::Levels& levels, double lo,
                                   double hi, bool hounsfield) {
  volume::ValueRange range{lo, hi, lo, hi, hounsfield};
  const size_t mode = size_t(std::max_element(counts.begin(), counts.end()) - counts.begin());
  const double around = levels.value(int(mode));
  uint64_t all = 0;
  for (const uint64_t n : counts) all += n;

  // What is left when levels less than `width` from the most frequent one are background.
  const auto percentiles = [&](double width, double least_share) {
    const auto left = [&](size_t l) {
      return l == mode || std::abs(levels.value(int(l)) - around) < width ? 0 : counts[l];
    };
    uint64_t rest = 0;
    for (size_t l = 0; l < counts.size(); ++l) rest += left(l);
    if (rest == 0 || double(rest) < least_share * double(all)) return false;
    uint64_t below = 0;
    bool found_lo = false;
    for (size_t l = 0; l < counts.size(); ++l) {
      below += left(l);
      const double value = std::clamp(levels.value(int(l)), lo, hi);
      if (!found_lo && double(below) >= 0.02 * double(rest)) range.typical_lo = value, found_lo = true;
      if (double(below) >= 0.995 * double(rest)) {
        range.typical_hi = value;
        break;
      }
    }
    return true;
  };
  if (!percentiles(0.04 * (hi - lo), 0.005)) percentiles(0, 0);
  return range;
}

}  // namespace telesplat::data
