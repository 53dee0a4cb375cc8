#include "common/points/compaction.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>

#include "common/core/check.h"
#include "common/image/normal.h"
#include "common/points/mosaic_builder.h"

namespace telesplat::points {
namespace {

// Points that are gathered from several mosaics for a new one.
struct PointSet {
  std::vector<uint16_t> x, y, z, normal;
  std::vector<uint32_t> colour;
  double range_sum = 0;  // sum of pixel ranges, weighted by points
  glm::dvec3 to_eye_sum{0};

  uint32_t size() const { return static_cast<uint32_t>(x.size()); }
  void clear() {
    x.clear(), y.clear(), z.clear(), normal.clear(), colour.clear();
    range_sum = 0;
    to_eye_sum = glm::dvec3(0);
  }
  void add(const Mosaic& m) {
    const Mosaic::Level l = m.level(0);
    x.insert(x.end(), l.x, l.x + l.count);
    y.insert(y.end(), l.y, l.y + l.count);
    z.insert(z.end(), l.z, l.z + l.count);
    normal.insert(normal.end(), l.normal, l.normal + l.count);
    colour.insert(colour.end(), l.colour, l.colour + l.count);
    note_source(m, l.count, m.pixel_range());
  }
  void add(const Mosaic& m, uint32_t i) {
    const Mosaic::Level l = m.level(0);
    x.push_back(l.x[i]), y.push_back(l.y[i]), z.push_back(l.z[i]);
    normal.push_back(l.normal[i]);
    colour.push_back(l.colour[i]);
  }
  float pixel_range() const { return static_cast<float>(range_sum / size()); }
  // Zero if the directions differ by more than about 20 degrees.
  glm::vec3 direction_to_eye() const {
    const double alike = 0.94 * size();
    return glm::dot(to_eye_sum, to_eye_sum) < alike * alike ? glm::vec3(0) : glm::vec3(to_eye_sum);
  }
  // Notes how `points` of m's points were sampled: from m's direction, at `range`.
  void note_source(const Mosaic& m, uint32_t points, float range) {
    range_sum += static_cast<double>(points) * static_cast<double>(range);
    to_eye_sum += static_cast<double>(points) * glm::dvec3(m.direction_to_eye());
  }
};

// Returns the axis that a normal is closest to, and its sign: 0..5.
uint32_t face_of(uint16_t normal) {
  const int x = std::min(normal & 255, 254) - 127, y = std::min(normal >> 8, 254) - 127;
  const int ax = std::abs(x), ay = std::abs(y), az = std::abs(127 - ax - ay);
  if (127 - ax - ay < 0) {
    // The lower half is folded outward: |x| and |y| of the direction are 127 - |y| and 127 - |x|.
    const int dx = 127 - ay, dy = 127 - ax;
    if (az >= dx && az >= dy) return 5;
    return dx >= dy ? (x < 0 ? 1u : 0u) : (y < 0 ? 3u : 2u);
  }
  if (az >= ax && az >= ay) return 4;
  return ax >= ay ? (x < 0 ? 1u : 0u) : (y < 0 ? 3u : 2u);
}

// Cell keys -> numbers in order of appearance, by open addressing, at most half full.
class CellTable {
 public:
  void begin(size_t most) {
    const size_t slots = std::bit_ceil(std::max<size_t>(2 * most, 16));
    if (keys_.size() < slots) keys_.resize(slots), numbers_.resize(slots);
    mask_ = slots - 1;
    std::fill_n(numbers_.begin(), slots, 0u);
    count_ = 0;
  }
  // Returns the cell's number; gives a new cell the next one.
  uint32_t number(uint64_t key) {
    const size_t at = slot(key);
    if (numbers_[at] == 0) keys_[at] = key, numbers_[at] = ++count_;
    return numbers_[at] - 1;
  }
  static constexpr uint32_t kNone = ~0u;
  uint32_t find(uint64_t key) const { return numbers_[slot(key)] - 1; }
  uint32_t count() const { return count_; }

 private:
  size_t slot(uint64_t key) const {
    size_t at = (key * 0x9e3779b97f4a7c15ull >> 20) & mask_;
    while (numbers_[at] != 0 && keys_[at] != key) at = (at + 1) & mask_;
    return at;
  }
  std::vector<uint64_t> keys_;
  std::vector<uint32_t> numbers_;  // number + 1; 0 = free
  size_t mask_ = 0;
  uint32_t count_ = 0;
};

// A grid of `side` cells along each edge of the leaf.
struct Grid {
  uint32_t side;
  uint32_t along(uint16_t q) const { return q * side >> 16; }
  uint64_t key(uint16_t x, uint16_t y, uint16_t z, uint32_t face) const {
    return uint64_t{along(x)} | uint64_t{along(y)} << 16 | uint64_t{along(z)} << 32 | uint64_t{face} << 48;
  }
  bool is_odd(uint16_t x, uint16_t y, uint16_t z) const { return (along(x) + along(y) + along(z)) & 1; }
  // Returns twice the distance from the cell's centre along one axis, in parts of the cell's side: -65536..65536.
  int64_t off(uint16_t q) const { return 2 * static_cast<int64_t>(q * side & 0xffff) - 65536; }
  int64_t off2(uint16_t x, uint16_t y, uint16_t z) const { return off(x) * off(x) + off(y) * off(y) + off(z) * off(z); }
};

// Number of cells a side whose sides are about `distances` sample distances long.
uint32_t cells_a_side(double pixel_range, double distances) {
  return static_cast<uint32_t>(std::clamp(std::floor(pixel_range / distances + 0.5), 1.0, 4096.0));
}

struct Cell {
  uint32_t representative;
  int64_t off2;
  uint32_t r, g, b, n;
  uint32_t mean() const { return (r + n / 2) / n << 16 | (g + n / 2) / n << 8 | (b + n / 2) / n; }
};

// Cells of a grid, and the cell of each point (of level 2: of each cell of level 1).
struct Level {
  std::vector<Cell> cells;
  std::vector<uint32_t> cell_of;
};

// Buffers of a merge, kept from merge to merge.
struct Scratch {
  PointSet points, rest;
  CellTable table;
  Level level1, level2;
  std::vector<uint32_t> counts;
  std::vector<uint8_t> rank, surrounded;
};
thread_local Scratch scratch;

// Takes points from a coarser mosaic only if at least 1 / kLeastTaken of them go: the rest must be built anew.
constexpr uint32_t kLeastTaken = 4;
constexpr int kMergedRanks = 5;  // level 2 has one rank, levels 1 and 0 two halves each

// Gathers `count` points into cells: point(i) lies in the cell grid key of i.
void fill_cells(const PointSet& p, const Grid& grid, Level& level, uint32_t count, const auto& point,
                const auto& add_colour) {
  auto& [cells, cell_of] = level;
  scratch.table.begin(count);
  cells.clear();
  cell_of.resize(count);
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t at = point(i);
    const uint32_t c = scratch.table.number(grid.key(p.x[at], p.y[at], p.z[at], face_of(p.normal[at])));
    const int64_t off2 = grid.off2(p.x[at], p.y[at], p.z[at]);
    if (c == cells.size()) cells.push_back({at, off2, 0, 0, 0, 0});
    Cell& cell = cells[c];
    if (off2 < cell.off2) cell.representative = at, cell.off2 = off2;
    add_colour(cell, i);
    cell_of[i] = c;
  }
}

// Builds a mosaic of the same points without coarser levels.
Mosaic build_plain(const PointSet& p, Sequence sequence, FrameId frame) {
  const uint32_t n = p.size();
  MosaicBuilder out(sequence, frame, {n, n, n});
  std::copy(p.x.begin(), p.x.end(), out.x);
  std::copy(p.y.begin(), p.y.end(), out.y);
  std::copy(p.z.begin(), p.z.end(), out.z);
  std::copy(p.normal.begin(), p.normal.end(), out.normal);
  std::copy(p.colour.begin(), p.colour.end(), out.colour);
  return out.finish(p.pixel_range(), p.direction_to_eye());
}

Mosaic build(const PointSet& p, Sequence sequence, FrameId frame) {
  const uint32_t n = p.size();
  if (n < kSmallMosaic) return build_plain(p, sequence, frame);
  Scratch& s = scratch;
  const double range = p.range_sum / n;
  const Grid grid2{cells_a_side(range, 4)}, grid1{2 * grid2.side}, grid0{4 * grid2.side};

  fill_cells(
      p, grid1, s.level1, n, [](uint32_t i) { return i; },
      [&](Cell& cell, uint32_t i) {
        const uint32_t c = p.colour[i];
        cell.r += c >> 16 & 255, cell.g += c >> 8 & 255, cell.b += c & 255, ++cell.n;
      });
  fill_cells(
      p, grid2, s.level2, static_cast<uint32_t>(s.level1.cells.size()),
      [&](uint32_t i) { return s.level1.cells[i].representative; },
      [&](Cell& cell, uint32_t i) {
        const Cell& fine = s.level1.cells[i];
        cell.r += fine.r, cell.g += fine.g, cell.b += fine.b, cell.n += fine.n;
      });

  // Computes ranks, and the begin of each.
  s.rank.resize(n);
  std::array<uint32_t, kMergedRanks> count{};
  for (uint32_t i = 0; i < n; ++i) {
    const uint32_t c1 = s.level1.cell_of[i];
    const bool of_level1 = s.level1.cells[c1].representative == i;
    const bool of_level2 = of_level1 && s.level2.cells[s.level2.cell_of[c1]].representative == i;
    const Grid& grid = of_level1 ? grid1 : grid0;
    const int rank = of_level2 ? 0 : (of_level1 ? 1 : 3) + grid.is_odd(p.x[i], p.y[i], p.z[i]);
    s.rank[i] = static_cast<uint8_t>(rank);
    ++count[rank];
  }
  std::array<uint32_t, kMergedRanks> next{};
  for (int r = 1; r < kMergedRanks; ++r) next[r] = next[r - 1] + count[r - 1];

  MosaicBuilder out(sequence, frame, {n, next[3], next[1]});
  for (uint32_t i = 0; i < n; ++i) {
    const uint32_t at = next[s.rank[i]]++;
    out.x[at] = p.x[i], out.y[at] = p.y[i], out.z[at] = p.z[i];
    out.normal[at] = p.normal[i];
    out.colour[at] = p.colour[i];
    if (s.rank[i] < 3 && out.mean1) out.mean1[at] = s.level1.cells[s.level1.cell_of[i]].mean();
    if (s.rank[i] == 0 && out.mean2) out.mean2[at] = s.level2.cells[s.level2.cell_of[s.level1.cell_of[i]]].mean();
  }
  return out.finish(p.pixel_range(), p.direction_to_eye());
}

// Tests if finer points surround those of a coarser mosaic: counts finer points in each cell, one sample distance wide,
// and notes which of its eight octants they lie in.
class FinerPoints {
 public:
  FinerPoints(const Mosaic& coarse, int finest_class)
      : grid_{cells_a_side(coarse.pixel_range(), 1)},
        halves_{2 * grid_.side},
        // Density grows with the square: an octave is four times as many points. Three quarters of a full cell must be
        // there: half of it may belong to neighbours of a sample without finer samples around it.
        enough_(3u << 2 * std::clamp(finest_class - density_class(coarse.pixel_range()) - 1, 0, 6)) {}

  void begin(size_t most) {
    scratch.table.begin(most);
    scratch.counts.clear();
  }
  void add(uint32_t n, const uint16_t* x, const uint16_t* y, const uint16_t* z, const uint16_t* normal) {
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t c = scratch.table.number(grid_.key(x[i], y[i], z[i], face_of(normal[i])));
      if (c == scratch.counts.size()) scratch.counts.push_back(0);
      uint32_t& count = scratch.counts[c];
      count |=
          1u << (kOctants + (halves_.along(x[i]) & 1) + 2 * (halves_.along(y[i]) & 1) + 4 * (halves_.along(z[i]) & 1));
      if ((count & kMostCounted) < kMostCounted) ++count;
    }
  }
  bool surround(const Mosaic::Level& l, uint32_t i) const {
    const uint32_t c = scratch.table.find(grid_.key(l.x[i], l.y[i], l.z[i], face_of(l.normal[i])));
    if (c == CellTable::kNone) return false;
    const uint32_t count = scratch.counts[c];
    return (count & kMostCounted) >= enough_ && std::popcount(count >> kOctants) >= kLeastOctants;
  }

 private:
  static constexpr uint32_t kOctants = 24, kMostCounted = (1u << kOctants) - 1;  // a word: octants above, count below
  // A surface crosses four octants or more. Fewer than this mean a clump of many samples with nothing beside it.
  static constexpr int kLeastOctants = 3;
  Grid grid_, halves_;
  uint32_t enough_;
};

// True if the mosaics have the same group and class. The mean of a class sets the size of its splats, so samples an
// octave coarser would have gaps between them.
bool may_merge(const Mosaic& m, const Mosaic& fresh) {
  return m.group() == fresh.group() && density_class(m.pixel_range()) == density_class(fresh.pixel_range());
}

bool contains(const std::vector<uint32_t>& list, uint32_t i) {
  return std::find(list.begin(), list.end(), i) != list.end();
}

// Returns the mosaics to merge with `fresh`, ascending: chosen from the smallest on, while they are of similar size.
std::vector<uint32_t> mergeable(const std::vector<Mosaic>& mosaics, const Mosaic& fresh) {
  std::vector<uint32_t> out;
  uint32_t total = fresh.count(0);
  while (true) {
    const Mosaic* smallest = nullptr;
    for (const Mosaic& m : mosaics)
      if (may_merge(m, fresh) && !contains(out, static_cast<uint32_t>(&m - mosaics.data())) &&
          (!smallest || m.count(0) < smallest->count(0)))
        smallest = &m;
    if (!smallest) break;
    const uint32_t count = smallest->count(0);
    if (count >= kSmallMosaic && count > kGrowth * total) break;
    total += count;
    out.push_back(static_cast<uint32_t>(smallest - mosaics.data()));
  }
  std::sort(out.begin(), out.end());
  return out;
}

// Marks, in scratch.surrounded, the points of `coarse` that are surrounded by the first `own` of p and by finer mosaics
// that stay. Returns their number.
uint32_t find_surrounded(const std::vector<Mosaic>& mosaics, const std::vector<uint32_t>& replaced,
                         const Mosaic& coarse, int merged_class, const PointSet& p, uint32_t own) {
  FinerPoints finer(coarse, merged_class);
  const auto for_finer = [&](const auto& visit) {
    for (uint32_t j = 0; j < mosaics.size(); ++j)
      if (density_class(mosaics[j].pixel_range()) > density_class(coarse.pixel_range()) &&
          mosaics[j].group() == coarse.group() && !contains(replaced, j))
        visit(mosaics[j].level(0));
  };
  size_t most = own;
  for_finer([&](const Mosaic::Level& l) { most += l.count; });
  finer.begin(most);
  finer.add(own, p.x.data(), p.y.data(), p.z.data(), p.normal.data());
  for_finer([&](const Mosaic::Level& l) { finer.add(l.count, l.x, l.y, l.z, l.normal); });
  const Mosaic::Level l = coarse.level(0);
  scratch.surrounded.resize(l.count);
  uint32_t count = 0;
  for (uint32_t i = 0; i < l.count; ++i) count += scratch.surrounded[i] = finer.surround(l, i);
  return count;
}

// Gathers the levels' points, in fractions of the cube.
void gather(const std::vector<PlacedLevel>& parts, int shift, float pixel_range, PointSet& p) {
  p.clear();
  for (const PlacedLevel& part : parts) {
    const Mosaic::Level l = part.mosaic->level(part.level);
    const auto add = [&](std::vector<uint16_t>& to, const uint16_t* q, uint32_t leaf) {
      for (uint32_t i = 0; i < l.count; ++i) to.push_back(static_cast<uint16_t>((leaf << 16 | q[i]) >> shift));
    };
    add(p.x, l.x, part.x), add(p.y, l.y, part.y), add(p.z, l.z, part.z);
    p.normal.insert(p.normal.end(), l.normal, l.normal + l.count);
    p.colour.insert(p.colour.end(), l.colour, l.colour + l.count);
    p.note_source(*part.mosaic, l.count, pixel_range);
  }
}

}  // namespace

int density_class(float pixel_range) {
  int exponent = 0;
  (void)std::frexp(pixel_range, &exponent);  // the mantissa is in [1/2, 1)
  return exponent - 1;
}

Mosaic merge_mosaics(const std::vector<const Mosaic*>& parts, Sequence sequence) {
  CHECK(!parts.empty());
  PointSet& p = scratch.points;
  p.clear();
  for (const Mosaic* m : parts) p.add(*m);
  return build(p, sequence, FrameId{parts.back()->frame_tag()});
}

Mosaic with_points(const Mosaic& mosaic, const std::vector<std::pair<uint32_t, LeafPoint>>& points) {
  PointSet& p = scratch.points;
  p.clear();
  p.add(mosaic);
  for (const auto& [i, point] : points) {
    CHECK(i < p.size());
    p.x[i] = point.x, p.y[i] = point.y, p.z[i] = point.z;
    p.normal[i] = point.normal;
    p.colour[i] = point.colour;
  }
  return build(p, mosaic.sequence(), FrameId{mosaic.frame_tag()});
}

Mosaic merge_levels(const std::vector<PlacedLevel>& parts, int shift, float pixel_range, Sequence sequence) {
  gather(parts, shift, pixel_range, scratch.points);
  return build(scratch.points, sequence, {});
}

Mosaic representatives(const std::vector<PlacedLevel>& parts, int shift, float pixel_range, Sequence sequence) {
  PointSet& p = scratch.points;
  gather(parts, shift, 2 * pixel_range, p);
  // With samples half as far apart, level 1 has the wanted points.
  const Mosaic dense = build(p, sequence, {});
  const Mosaic::Level l1 = dense.level(1), l2 = dense.level(2);
  MosaicBuilder out(sequence, {}, {l1.count, l2.count, l2.count});
  std::copy_n(l1.x, l1.count, out.x);
  std::copy_n(l1.y, l1.count, out.y);
  std::copy_n(l1.z, l1.count, out.z);
  std::copy_n(l1.normal, l1.count, out.normal);
  std::copy_n(l1.colour, l1.count, out.colour);
  if (out.mean1) std::copy_n(l2.colour, l2.count, out.mean1);
  return out.finish(pixel_range, p.direction_to_eye());
}

Merge plan_merge(const std::vector<Mosaic>& mosaics, Mosaic fresh) {
  if ((fresh.frame_tag() & kProvisionalTag) != 0) {
    Merge alone;
    alone.added.push_back(std::move(fresh));
    return alone;
  }
  Merge out{mergeable(mosaics, fresh), {}};
  PointSet& p = scratch.points;
  p.clear();
  for (const uint32_t i : out.replaced) p.add(mosaics[i]);
  p.add(fresh);

  const uint32_t own = p.size();
  const float range = p.pixel_range();
  const int merged_class = density_class(range);
  for (uint32_t i = 0; own >= kSmallMosaic && i < mosaics.size(); ++i) {
    const Mosaic& coarse = mosaics[i];
    if (density_class(coarse.pixel_range()) >= merged_class || coarse.group() != fresh.group() ||
        contains(out.replaced, i))
      continue;
    const uint32_t surrounded = find_surrounded(mosaics, out.replaced, coarse, merged_class, p, own);
    if (surrounded == 0 || surrounded * kLeastTaken < coarse.count(0)) continue;
    PointSet& rest = scratch.rest;
    rest.clear();
    for (uint32_t k = 0; k < coarse.count(0); ++k) (scratch.surrounded[k] ? p : rest).add(coarse, k);
    p.note_source(coarse, surrounded, range);
    out.replaced.push_back(i);
    if (rest.size() == 0) continue;
    rest.note_source(coarse, rest.size(), coarse.pixel_range());
    out.added.push_back(build(rest, fresh.sequence(), FrameId{fresh.frame_tag()}));
  }
  std::sort(out.replaced.begin(), out.replaced.end());
  if (out.replaced.empty())
    out.added.push_back(std::move(fresh));  // unchanged
  else
    out.added.push_back(build(p, fresh.sequence(), FrameId{fresh.frame_tag()}));
  return out;
}

}  // namespace telesplat::points
