#include "services/packer/points/plan/known_empty.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/vector_relational.hpp>
#include <numeric>

namespace telesplat::packer {
namespace {

constexpr int kBlocksASide = 1 << KnownEmpty::kBlockLevel;
constexpr int kMostReach = 8;  // largest distance, in blocks, up to which a point marks space as seen
constexpr int kRefillBlocks = 3;

// Returns v with its bits at every third place.
constexpr uint32_t spread(uint32_t v) {
  uint32_t out = 0;
  for (int bit = 0; bit < KnownEmpty::kBlockLevel; ++bit) out |= (v >> bit & 1) << (3 * bit);
  return out;
}
constexpr std::array<uint32_t, kBlocksASide> kSpread = [] {
  std::array<uint32_t, kBlocksASide> out{};
  for (uint32_t v = 0; v < kBlocksASide; ++v) out[v] = spread(v);
  return out;
}();
uint32_t morton(int x, int y, int z) {
  return kSpread[static_cast<size_t>(x)] | kSpread[static_cast<size_t>(y)] << 1 | kSpread[static_cast<size_t>(z)] << 2;
}

size_t bytes_of(int level) { return level == 0 ? 1 : size_t{1} << (3 * (level - 1)); }

glm::ivec3 leaf_of(points::ClusterKey key) {
  return {static_cast<int>(key & 1023), static_cast<int>(key >> 10 & 1023), static_cast<int>(key >> 20 & 1023)};
}

// Returns the distance between neighbouring samples of a mosaic.
double spacing_m(const points::Mosaic& mosaic, double leaf_m) {
  return leaf_m / std::max(static_cast<double>(mosaic.pixel_range()), 1e-3);
}

}  // namespace

KnownEmpty::KnownEmpty(const points::ModelConfig& model) : model_(model), grid_(points::octree_grid(model)) {
  for (int level = 0; level <= kCellLevel; ++level) any_[static_cast<size_t>(level)].resize(bytes_of(level));
  for (int level = 0; level <= kBlockLevel; ++level) {
    hides_[static_cast<size_t>(level)].resize(bytes_of(level));
    all_[static_cast<size_t>(level)].resize(bytes_of(level));
  }
  dirty_.resize(size_t{1} << (3 * kDirtyLevel));
  clear();
}

void KnownEmpty::clear() {
  // One block more on each side: the box may be rounded.
  const glm::dvec3 lo = (glm::dvec3(model_.box_room.lo) - grid_.lo) / (2 * cell_m()),
                   hi = (glm::dvec3(model_.box_room.hi) - grid_.lo) / (2 * cell_m());
  const glm::ivec3 first = glm::ivec3(glm::floor(lo)) - 1, last = glm::ivec3(glm::floor(hi)) + 1;
  const auto fill = [&](const auto& self, int level, uint32_t node, const glm::ivec3& at) -> void {
    const int side = kBlocksASide >> level, down = 3 * (kBlockLevel - level);
    const glm::ivec3 end = at + (side - 1);
    const bool outside = glm::any(glm::lessThan(end, first)) || glm::any(glm::greaterThan(at, last));
    if (outside || (glm::all(glm::greaterThanEqual(at, first)) && glm::all(glm::lessThanEqual(end, last)))) {
      std::memset(any_[kCellLevel].data() + (size_t{node} << down), outside ? 0 : 0xff, size_t{1} << down);
      return;
    }
    for (int i = 0; i < 8; ++i)
      self(self, level + 1, node << 3 | static_cast<uint32_t>(i),
           at + side / 2 * glm::ivec3(i & 1, i >> 1 & 1, i >> 2 & 1));
  };
  fill(fill, 0, 0, glm::ivec3(0));
  std::fill(dirty_.begin(), dirty_.end(), uint8_t{1});
  any_dirty_ = true;
  settle();
}

void KnownEmpty::set_block_range(const glm::ivec3& lo, const glm::ivec3& hi, uint8_t cells) {
  const glm::ivec3 first = glm::max(lo, 0), last = glm::min(hi, kBlocksASide - 1);
  for (int z = first.z; z <= last.z; ++z)
    for (int y = first.y; y <= last.y; ++y) {
      const uint32_t row = morton(0, y, z);
      for (int x = first.x; x <= last.x; ++x) {
        const uint32_t block = row | kSpread[static_cast<size_t>(x)];
        any_[kCellLevel][block] = cells;
        note_block(block);
      }
    }
}

void KnownEmpty::add(const points::PreparedPatch& patch) {
  for (const auto& [key, mosaic] : patch.mosaics) see(key, mosaic);
  settle();
}

void KnownEmpty::add(const points::PointModel& model) {
  for (const auto& [key, cluster] : model.clusters())
    for (const points::Mosaic& mosaic : cluster->mosaics) see(key, mosaic);
  settle();
}

void KnownEmpty::see(points::ClusterKey key, const points::Mosaic& mosaic) {
  const int shift = kBlockLevel - grid_.depth;  // a leaf is 2^shift blocks long
  const double apart = spacing_m(mosaic, grid_.leaf_size) / (2 * cell_m());
  const int reach = static_cast<int>(std::min<double>(apart + (apart * kFewPixels >= 1), kMostReach));
  const glm::ivec3 leaf = leaf_of(key);
  if (shift <= 0) {
    const glm::ivec3 block{leaf.x >> -shift, leaf.y >> -shift, leaf.z >> -shift};
    set_block_range(block - reach, block + reach, 0);
    return;
  }
  // Each block is set once, however many points lie in it.
  occupied_.assign((size_t{1} << (3 * shift)) / 64 + 1, 0);
  const points::Mosaic::Level points = mosaic.level(0);
  for (uint32_t i = 0; i < points.count; ++i) {
    const int down = 16 - shift;
    const uint32_t at = static_cast<uint32_t>(points.x[i] >> down) |
                        static_cast<uint32_t>(points.y[i] >> down) << shift |
                        static_cast<uint32_t>(points.z[i] >> down) << (2 * shift);
    occupied_[at >> 6] |= uint64_t{1} << (at & 63);
  }
  const uint32_t side = (1u << shift) - 1;
  for (size_t word = 0; word < occupied_.size(); ++word)
    for (uint64_t rest = occupied_[word]; rest != 0; rest &= rest - 1) {
      const auto at = static_cast<uint32_t>(word * 64 + static_cast<size_t>(std::countr_zero(rest)));
      const glm::ivec3 block{(leaf.x << shift) + static_cast<int>(at & side),
                             (leaf.y << shift) + static_cast<int>(at >> shift & side),
                             (leaf.z << shift) + static_cast<int>(at >> (2 * shift) & side)};
      set_block_range(block - reach, block + reach, 0);
    }
}

void KnownEmpty::forget(std::span<const points::ClusterKey> clusters) {
  const int shift = kBlockLevel - grid_.depth;
  for (const points::ClusterKey key : clusters) {
    const glm::ivec3 leaf = leaf_of(key);
    if (shift <= 0) {
      const glm::ivec3 block{leaf.x >> -shift, leaf.y >> -shift, leaf.z >> -shift};
      set_block_range(block, block, 0xff);
    } else {
      const glm::ivec3 block{leaf.x << shift, leaf.y << shift, leaf.z << shift};
      set_block_range(block, block + ((1 << shift) - 1), 0xff);
    }
  }
  settle();
}

void KnownEmpty::refill(std::span<const glm::vec3> points_room) {
  for (const glm::vec3& p : points_room) {
    const glm::dvec3 at = (glm::dvec3(p) - grid_.lo) / (2 * cell_m());
    // NaN counts as outside, too.
    const auto inside = [](double v) { return v >= 0 && v < kBlocksASide; };
    if (!inside(at.x) || !inside(at.y) || !inside(at.z)) continue;
    set_block_range(glm::ivec3(at) - kRefillBlocks, glm::ivec3(at) + kRefillBlocks, 0xff);
  }
  settle();
}

namespace {

// Eight bits, one per byte, the first byte's lowest. some_of: byte != 0; each_of: byte == 255.
uint8_t some_of(uint64_t bytes) {
  constexpr uint64_t kLow = 0x7f7f7f7f7f7f7f7f;
  const uint64_t tops = (((bytes & kLow) + kLow) | bytes) & ~kLow;
  return static_cast<uint8_t>((tops >> 7) * 0x0102040810204080 >> 56);
}
uint8_t each_of(uint64_t bytes) { return static_cast<uint8_t>(~some_of(~bytes)); }

// Computes the bits of `count` nodes (a multiple of 8, or the root alone) from `first` on, from their children's.
template <class Bits>
void fold(const std::vector<uint8_t>& children, std::vector<uint8_t>& level, size_t first, size_t count, Bits bits) {
  if (count == 1) {
    level[0] = bits(children[0]) & 1;
    return;
  }
  for (size_t node = first; node < first + count; node += 8) {
    uint64_t bytes = 0;
    std::memcpy(&bytes, children.data() + node, 8);
    level[node / 8] = bits(bytes);
  }
}

}  // namespace

void KnownEmpty::fold_level(int level, size_t first, size_t count) {
  const auto l = static_cast<size_t>(level);
  fold(any_[l + 1], any_[l], first, count, some_of);
  if (level == kBlockLevel) {
    fold(any_[l + 1], hides_[l], first, count, each_of);
    fold(any_[l + 1], all_[l], first, count, each_of);
  } else {
    fold(hides_[l + 1], hides_[l], first, count, some_of);
    fold(all_[l + 1], all_[l], first, count, each_of);
  }
}

void KnownEmpty::settle() {
  if (!any_dirty_) return;
  for (size_t node = 0; node < dirty_.size(); ++node) {
    if (!dirty_[node]) continue;
    dirty_[node] = 0;
    for (int level = kBlockLevel; level > kDirtyLevel; --level) {
      const size_t nodes = size_t{1} << (3 * (level - kDirtyLevel));
      fold_level(level, node * nodes, nodes);
    }
  }
  for (int level = kDirtyLevel; level >= 0; --level) fold_level(level, 0, size_t{1} << (3 * level));
  any_dirty_ = false;
}

bool KnownEmpty::unseen(const glm::ivec3& cell) const {
  const uint8_t byte = any_[kCellLevel][morton(cell.x >> 1, cell.y >> 1, cell.z >> 1)];
  return (byte >> ((cell.x & 1) | (cell.y & 1) << 1 | (cell.z & 1) << 2) & 1) != 0;
}

bool KnownEmpty::unseen_at(const glm::dvec3& room) const {
  const glm::dvec3 cell = glm::floor((room - grid_.lo) / cell_m());
  for (int i = 0; i < 3; ++i)
    if (!(cell[i] >= 0 && cell[i] < 1 << kCellLevel)) return false;
  return unseen(glm::ivec3(cell));
}

uint64_t KnownEmpty::unseen_cells() const {
  return std::accumulate(any_[kCellLevel].begin(), any_[kCellLevel].end(), uint64_t{0},
                         [](uint64_t n, uint8_t byte) { return n + static_cast<uint64_t>(std::popcount(byte)); });
}

}  // namespace telesplat::packer
