#include "common/points/decimate.h"

#include <algorithm>
#include <bit>

namespace telesplat::points {
namespace {

// Depths z = c / code differ by at most 2 % of the first one: |z - z0| <= 0.02 z0.
bool near_in_depth(uint32_t code_first, uint32_t code) {
  const uint32_t difference = code_first > code ? code_first - code : code - code_first;
  return difference * 50 <= code;
}

// First rank of each pixel of a 2x2 block; the upper left one needs none, since it is the first of its group.
constexpr int kRankOfPixel[4] = {0, kFirstRankOfLevel0 + 4, kFirstRankOfLevel0 + 8, kFirstRankOfLevel0};

// Sums of many colours, channel by channel.
struct ColourSum {
  uint32_t r = 0, g = 0, b = 0, n = 0;
  void add(uint32_t c) { r += c >> 16 & 255, g += c >> 8 & 255, b += c & 255, ++n; }
  uint32_t mean() const { return (r + n / 2) / n << 16 | (g + n / 2) / n << 8 | (b + n / 2) / n; }
};

// The mean of four colours, all channels at once, rounded in the same way.
uint32_t mean_of_four(uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
  constexpr uint32_t kRedBlue = 0x00ff00ff;
  const uint32_t rb = (a & kRedBlue) + (b & kRedBlue) + (c & kRedBlue) + (d & kRedBlue) + 0x00020002;
  const uint32_t g = (a >> 8 & 255) + (b >> 8 & 255) + (c >> 8 & 255) + (d >> 8 & 255) + 2;
  return (rb >> 2 & kRedBlue) | (g >> 2 & 255) << 8;
}

// Leaf keys -> indices in order of appearance, by open addressing, at most half full.
class LeafTable {
 public:
  explicit LeafTable(std::vector<DecimatedTile::Leaf>& leaves) : leaves_(leaves), slots_(1024) {}

  uint32_t index_of(ClusterKey key) {
    if (key == last_key_) return last_index_;
    last_key_ = key;
    return last_index_ = look_up(key);
  }

 private:
  uint32_t look_up(ClusterKey key) {
    uint32_t& slot = slot_of(key);
    if (slot != 0) return slot - 1;
    leaves_.push_back({key});
    slot = static_cast<uint32_t>(leaves_.size());
    if (leaves_.size() * 2 > slots_.size()) grow();
    return static_cast<uint32_t>(leaves_.size()) - 1;
  }
  uint32_t& slot_of(ClusterKey key) {
    const int shift = 32 - std::countr_zero(slots_.size());
    for (size_t i = key * 2654435769u >> shift;; i = (i + 1) & (slots_.size() - 1))
      if (slots_[i] == 0 || leaves_[slots_[i] - 1].key == key) return slots_[i];
  }
  void grow() {
    slots_.assign(slots_.size() * 2, 0);
    for (size_t i = 0; i < leaves_.size(); ++i) slot_of(leaves_[i].key) = static_cast<uint32_t>(i) + 1;
  }

  std::vector<DecimatedTile::Leaf>& leaves_;
  std::vector<uint32_t> slots_;  // index + 1; 0 = free
  ClusterKey last_key_ = kNoCluster;
  uint32_t last_index_ = 0;
};

class Decimator {
 public:
  Decimator(const image::DepthImage& image, const ClusterKey* keys)
      : width_(image.width),
        height_(image.height),
        depth_(image.depth.data()),
        colour_(image.colour.data()),
        keys_(keys) {
    out_.blocks.reserve(image.pixels() / 16);
  }

  DecimatedTile run(const geometry::Rect& tile) {
    for (int y = -(tile.y & 3); y < height_; y += 4)
      for (int x0 = -(tile.x & 3); x0 < width_; x0 += kStretch)
        if (any_covered(x0, y)) take_stretch(x0, y);
    return std::move(out_);
  }

 private:
  static constexpr int kStretch = 64;  // pixels of four rows skipped at once: most of a tile with few rays

  bool any_covered(int x0, int y0) const {
    const int begin = std::max(x0, 0), end = std::min(x0 + kStretch, width_);
    uint32_t any = 0;
    for (int y = std::max(y0, 0); y < std::min(y0 + 4, height_); ++y) {
      const uint32_t* row = depth_ + static_cast<size_t>(y) * width_;
      for (int x = begin; x < end; ++x) any |= row[x];
    }
    return any != 0;
  }

  void take_stretch(int x0, int y) {
    for (int x = x0; x < std::min(x0 + kStretch, width_); x += 4) {
      const bool whole = x >= 0 && y >= 0 && x + 4 <= width_ && y + 4 <= height_;
      if (!(whole && take_whole(x, y))) take_parts(x, y);
    }
  }

  // One of up to 16 samples of a block.
  struct Candidate {
    SampleEntry entry;
    ClusterKey key;
    uint32_t code;
    int sub;       // 2x2 block, 0..3
    int distance;  // from the 4x4 block's centre, squared, in half pixels
    bool taken;
  };

  // Takes a block that is empty, or flat and in one leaf, as a whole. False: it is neither.
  bool take_whole(int x, int y) {
    const uint32_t pixel = static_cast<uint32_t>(y * width_ + x);
    const ClusterKey key = keys_[pixel];
    uint32_t differs = 0, nothing = kNoCluster, least = ~0u, most = 0;
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < 4; ++i) {
        const size_t p = pixel + static_cast<size_t>(j) * width_ + i;
        differs |= keys_[p] ^ key;
        nothing &= keys_[p];
        least = std::min(least, depth_[p]), most = std::max(most, depth_[p]);
      }
    }
    if (nothing == kNoCluster) return true;
    if (differs != 0) return false;
    // Stricter than comparing each with the first: a block that passes is one group at every level.
    if (!near_in_depth(most, least)) return false;

    BlockEntry block{pixel, leaves_.index_of(key), {}};
    const size_t w = width_;
    for (int s = 0; s < 4; ++s) {
      const uint32_t* c = colour_ + pixel + (s >> 1) * 2 * w + (s & 1) * 2;
      block.mean[s] = mean_of_four(c[0], c[1], c[w], c[w + 1]);
    }
    block.mean[4] = mean_of_four(block.mean[0], block.mean[1], block.mean[2], block.mean[3]);
    auto& count = out_.leaves[block.leaf].count;
    for (uint32_t& rank : count) ++rank;
    out_.blocks.push_back(block);
    return true;
  }

  // Takes the block sample by sample: grouped by leaf and depth, first within 2x2 blocks, then within the 4x4 block.
  void take_parts(int x, int y) {
    Candidate c[16];
    const int n = gather(x, y, c);
    if (n == 0) return;

    int firsts[16], first_count = 0;
    for (int i = 0; i < n; ++i) {
      if (c[i].taken) continue;
      firsts[first_count++] = i;
      ColourSum sum;
      for (int j = i; j < n && c[j].sub == c[i].sub; ++j) {
        if (c[j].taken || c[j].key != c[i].key || !near_in_depth(c[i].code, c[j].code)) continue;
        c[j].taken = true;
        sum.add(colour_[c[j].entry.pixel]);
      }
      // All four lie equally near to the 2x2 block's centre: takes the first.
      c[i].entry.rank = static_cast<uint32_t>(std::max(kBlockPlace[c[i].sub], 1));
      c[i].entry.mean[0] = sum.mean();
    }

    for (int f = 0; f < first_count; ++f) c[firsts[f]].taken = false;
    for (int f = 0; f < first_count; ++f) {
      const Candidate& first = c[firsts[f]];
      if (first.taken) continue;
      ColourSum sum;
      Candidate* nearest = nullptr;
      for (int h = f; h < first_count; ++h) {
        Candidate& other = c[firsts[h]];
        if (other.taken || other.key != first.key || !near_in_depth(first.code, other.code)) continue;
        other.taken = true;
        sum.add(other.entry.mean[0]);
        if (!nearest || other.distance < nearest->distance) nearest = &other;
      }
      nearest->entry.rank = 0;
      nearest->entry.mean[1] = sum.mean();
    }

    for (int i = 0; i < n; ++i) {
      ++out_.leaves[c[i].entry.leaf].count[c[i].entry.rank];
      out_.samples.push_back(c[i].entry);
    }
  }

  int gather(int x, int y, Candidate* out) {
    int n = 0;
    for (int s = 0; s < 4; ++s) {
      for (int p = 0; p < 4; ++p) {
        const int i = (s & 1) * 2 + (p & 1), j = (s >> 1) * 2 + (p >> 1);
        if (x + i < 0 || y + j < 0 || x + i >= width_ || y + j >= height_) continue;
        const uint32_t pixel = static_cast<uint32_t>((y + j) * width_ + x + i);
        if (keys_[pixel] == kNoCluster) continue;
        const int dx = 2 * i - 3, dy = 2 * j - 3;
        // Starts with the rank of a sample that is not the first of its group; first ones get their rank later.
        out[n++] = {
            {pixel, leaves_.index_of(keys_[pixel]), static_cast<uint32_t>(kRankOfPixel[p] + kBlockPlace[s]), {}},
            keys_[pixel],
            depth_[pixel],
            s,
            dx * dx + dy * dy,
            false};
      }
    }
    return n;
  }

  const int width_, height_;
  const uint32_t *depth_, *colour_;
  const ClusterKey* keys_;
  DecimatedTile out_;
  LeafTable leaves_{out_.leaves};
};

}  // namespace

DecimatedTile decimate(const geometry::Rect& tile, const image::DepthImage& image, const ClusterKey* keys) {
  return Decimator(image, keys).run(tile);
}

}  // namespace telesplat::points
