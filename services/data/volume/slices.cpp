#include "services/data/volume/slices.h"

#include <fmt/format.h>
#include <tbb/combinable.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/matrix.hpp>
#include <numeric>

#include "common/core/check.h"
#include "common/image/normal.h"
#include "common/parallel/in_parallel.h"

namespace telesplat::data {
namespace {

constexpr double kMaxValue = volume::kMaxTransferValue;

bool is_byte(VoxelType type) { return type == VoxelType::kU8 || type == VoxelType::kI8; }

// Returns the levels of all bit patterns of an integer type; empty for floats.
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

// Calls body(level of voxel n, n) for n in [begin, end).
template <class Body>
void each_level(const Volume& volume, const volume::Levels& levels, const std::vector<uint16_t>& table, size_t begin,
                size_t end, const Body& body) {
  const std::byte* const stored = volume.stored.data();
  if (volume.type == VoxelType::kF32) {
    for (size_t n = begin; n < end; ++n) {
      float value;
      std::memcpy(&value, stored + n * sizeof value, sizeof value);
      body(std::isfinite(value) ? levels.level(double(value) * volume.scale + volume.offset) : uint16_t(0), n);
    }
  } else if (is_byte(volume.type)) {
    for (size_t n = begin; n < end; ++n) body(table[std::to_integer<uint8_t>(stored[n])], n);
  } else {
    for (size_t n = begin; n < end; ++n) {
      uint16_t bits;
      std::memcpy(&bits, stored + n * sizeof bits, sizeof bits);
      body(table[bits], n);
    }
  }
}

size_t voxels_a_slice(const Volume& volume) { return size_t(volume.size[0]) * size_t(volume.size[1]); }

// A voxel's neighbours along an axis, and one over their distance: beyond the grid's faces a voxel is its own
// neighbour.
struct Neighbours {
  ptrdiff_t before, after;
  float weight;
};
Neighbours neighbours(int at, int size, ptrdiff_t stride) {
  const bool first = at == 0, last = at == size - 1;
  return {first ? 0 : -stride, last ? 0 : stride, first && last ? 0.0f : first || last ? 1.0f : 0.5f};
}

// The wanted voxels of a row, before their number is known.
struct RowBuffer {
  uint16_t i[volume::kMaxSide + 1], level[volume::kMaxSide + 1];
};

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

  // Percentiles of the rest, if levels nearer than `width` to the most frequent one are background.
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

VolumeSlices::VolumeSlices(const Volume& v, const volume::Session& session, int begin, int end)
    : size_(v.size),
      begin_(begin),
      end_(end),
      stored_begin_(std::max(begin - 1, 0)),
      stored_end_(std::min(end + 1, v.size[2])),
      level_count_(session.levels.count),
      lit_(session.lit) {
  CHECK(v.size == session.grid.size && begin >= 0 && begin < end && end <= size_[2]);
  // Gradients are covectors: with room = M index, the gradient by room is transpose(inverse(M)) times the one by index.
  const glm::dmat3 m(session.grid.index_to_room);
  outward_ = glm::mat3(-session.grid.unit_m() * glm::transpose(glm::inverse(m)));
  levels_ = to_levels(v, session.levels, stored_begin_, stored_end_);
  levels_.narrow.empty() ? count(levels_.wide) : count(levels_.narrow);
}

size_t VolumeSlices::bytes() const {
  return levels_.narrow.size() + levels_.wide.size() * sizeof(uint16_t) + counts_.size() * sizeof(uint32_t);
}

template <class Level>
void VolumeSlices::count(const std::vector<Level>& levels) {
  const size_t slice = size_t(size_[0]) * size_t(size_[1]);
  counts_.resize(size_t(end_ - begin_) * size_t(level_count_));
  in_parallel(begin_, end_, [&](int k) {
    uint32_t* const mine = &counts_[size_t(k - begin_) * size_t(level_count_)];
    const Level* const first = &levels[size_t(k - stored_begin_) * slice];
    for (size_t n = 0; n < slice; ++n) ++mine[first[n]];
  });
}

uint32_t VolumeSlices::weight(int k, const volume::LevelSet& wanted) const {
  const uint32_t* const mine = &counts_[size_t(k - begin_) * size_t(level_count_)];
  uint32_t sum = 0;
  for (int l = 0; l < level_count_; ++l) sum += wanted.has(l) ? mine[l] : 0;
  return sum;
}

std::vector<uint32_t> VolumeSlices::weights(const volume::LevelSet& wanted) const {
  std::vector<uint32_t> out;
  for (int k = begin_; k < end_; ++k) out.push_back(weight(k, wanted));
  return out;
}

double VolumeSlices::level(int i, int j, int k) const {
  const int held = std::clamp(k, stored_begin_, stored_end_ - 1) - stored_begin_;
  const size_t n = (size_t(held) * size_t(size_[1]) + size_t(j)) * size_t(size_[0]) + size_t(i);
  return levels_.narrow.empty() ? double(levels_.wide[n]) : double(levels_.narrow[n]);
}

template <class Level>
void VolumeSlices::classify(const std::vector<Level>& levels, int k, const std::vector<uint8_t>& wanted,
                            volume::Voxels& out, size_t row, size_t at) const {
  static thread_local RowBuffer buffer;
  const size_t size_x = size_t(size_[0]), slice = size_x * size_t(size_[1]);
  const float negligible = float(level_count_) / 512, least = negligible * negligible;
  const Neighbours z = neighbours(k, size_[2], ptrdiff_t(slice));
  for (int j = 0; j < size_[1]; ++j, ++row) {
    const Level* const from = &levels[size_t(k - stored_begin_) * slice + size_t(j) * size_x];
    size_t n = 0;
    for (size_t i = 0; i < size_x; ++i) {
      buffer.i[n] = uint16_t(i), buffer.level[n] = from[i];
      n += wanted[from[i]];
    }
    std::copy_n(buffer.i, n, out.i.data() + at);
    std::copy_n(buffer.level, n, out.level.data() + at);
    if (lit_) {
      const Neighbours y = neighbours(j, size_[1], ptrdiff_t(size_x));
      for (size_t r = 0; r < n; ++r) {
        const Level* const p = from + buffer.i[r];
        const Neighbours x = neighbours(buffer.i[r], size_[0], 1);
        const glm::vec3 normal = outward_ * glm::vec3(x.weight * float(int(p[x.after]) - int(p[x.before])),
                                                      y.weight * float(int(p[y.after]) - int(p[y.before])),
                                                      z.weight * float(int(p[z.after]) - int(p[z.before])));
        out.normal[at + r] = glm::dot(normal, normal) < least ? volume::kNoNormal : image::encode_normal16(normal);
      }
    }
    at += n;
    out.rows[row + 1] = uint32_t(at);
  }
}

volume::Voxels VolumeSlices::voxels(int k_begin, int k_end, const volume::LevelSet& wanted) const {
  CHECK(begin_ <= k_begin && k_begin <= k_end && k_end <= end_);
  volume::Voxels out;
  out.k_begin = k_begin, out.k_end = k_end;
  const size_t rows_a_slice = size_t(size_[1]);
  out.rows.resize(size_t(k_end - k_begin) * rows_a_slice + 1);

  // The counts of levels give each slice's place among the voxels.
  std::vector<uint64_t> first{0};
  for (int k = k_begin; k < k_end; ++k) first.push_back(first.back() + weight(k, wanted));
  CHECK(first.back() <= UINT32_MAX);
  const size_t total = size_t(first.back());
  // One more, so that an empty tail has an address.
  out.i.reserve(total + 1), out.level.reserve(total + 1), out.normal.reserve(lit_ ? total + 1 : 0);
  out.i.resize(total), out.level.resize(total), out.normal.resize(lit_ ? total : 0);

  std::vector<uint8_t> table;
  for (int l = 0; l < level_count_; ++l) table.push_back(wanted.has(l));
  in_parallel(k_begin, k_end, [&](int k) {
    const size_t index = size_t(k - k_begin), row = index * rows_a_slice;
    if (first[index] == first[index + 1])
      std::fill_n(out.rows.begin() + ptrdiff_t(row) + 1, rows_a_slice, uint32_t(first[index]));
    else if (levels_.narrow.empty())
      classify(levels_.wide, k, table, out, row, size_t(first[index]));
    else
      classify(levels_.narrow, k, table, out, row, size_t(first[index]));
  });
  return out;
}

}  // namespace telesplat::data
