// The finish pixel by pixel, straight from its definition in common/splat/finish.h: slow, and sharing no code with it.
#pragma once

#include <cstdlib>
#include <vector>

#include "common/splat/finish.h"

namespace telesplat::testing {

/// A tile that owns its pixels, all empty at first.
struct OwnTile {
  OwnTile(int width, int height, int margin = splat::kFillRadius + 3 + splat::kFinishSlack)
      : stride(width + 2 * margin + splat::kFinishSlack),
        words(static_cast<size_t>(height + 2 * margin) * 2 * stride, 0x141820),
        tile{words.data(), stride, margin, width, height} {
    for (int y = -margin; y < height + margin; ++y)
      for (int x = -margin; x < stride - margin; ++x) tile.info(y)[x] = splat::kEmptyInfo;
  }
  OwnTile(const OwnTile& o) : stride(o.stride), words(o.words), tile(o.tile) { tile.rows = words.data(); }

  void set(int x, int y, uint32_t colour, uint32_t code, uint32_t spacing = 0) {
    tile.colour(y)[x] = colour;
    tile.info(y)[x] = code << 8 | spacing << 3;
  }
  uint32_t colour(int x, int y) const { return tile.colour(y)[x]; }
  uint32_t info(int x, int y) const { return tile.info(y)[x]; }
  bool empty(int x, int y) const { return info(x, y) == splat::kEmptyInfo; }

  int stride;
  std::vector<uint32_t> words;
  splat::ResolvedTile tile;
};

inline int64_t depth_code(uint32_t info) { return info == splat::kEmptyInfo ? 1 << 24 : info >> 8; }
inline int channel(uint32_t colour, int c) { return static_cast<int>(colour >> 8 * c & 255); }

inline void fill_plainly(OwnTile& t, int grow) {
  const OwnTile before = t;
  const int64_t edge = splat::kEdge;
  // In whole infos, like everything that the definition calls a code: what lies below the code's bits counts too.
  const auto code = [&](int x, int y) { return static_cast<int64_t>(before.info(x, y)); };
  for (int y = -grow; y < t.tile.height + grow; ++y)
    for (int x = -grow; x < t.tile.width + grow; ++x) {
      const auto nearer = [&](int i, int j) { return code(x, y) - code(i, j) > edge * 256; };
      if (!nearer(x - 1, y) && !nearer(x + 1, y) && !nearer(x, y - 1) && !nearer(x, y + 1)) continue;
      struct Pair {
        int x[2], y[2], distance[2];
        int64_t nearest;
      };
      std::vector<Pair> pairs;
      for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}, {1, 1}, {1, -1}}) {
        Pair p{};
        for (int side = 0; side < 2; ++side)
          for (int r = splat::kFillRadius; r >= 1; --r) {
            const int i = x + (side ? -r : r) * dx, j = y + (side ? -r : r) * dy;
            if (nearer(i, j)) p.x[side] = i, p.y[side] = j, p.distance[side] = r;
          }
        const int sum = p.distance[0] + p.distance[1];
        if (!p.distance[0] || !p.distance[1] || sum > splat::kFillRadius + 1) continue;
        const int64_t a = code(p.x[0], p.y[0]), b = code(p.x[1], p.y[1]);
        if (std::abs(a - b) > edge * 256 * sum) continue;
        p.nearest = std::min(a, b);
        pairs.push_back(p);
      }
      int64_t best = INT64_MAX;
      for (const Pair& p : pairs) best = std::min(best, p.nearest);
      int axes = 0, sums[3] = {}, weights = 0;
      int64_t depth = 0;
      bool tight = false;
      for (const Pair& p : pairs) {
        if (p.nearest > best + 2 * edge * 256) continue;
        ++axes;
        tight = tight || (p.distance[0] == 1 && p.distance[1] == 1);
        for (int side = 0; side < 2; ++side) {
          const int w = 36 / (p.distance[side] * p.distance[side]);
          weights += w;
          for (int c = 0; c < 3; ++c) sums[c] += w * channel(before.colour(p.x[side], p.y[side]), c);
          depth += w * (code(p.x[side], p.y[side]) >> 8);
        }
      }
      if (axes < 2 && !tight) continue;
      uint32_t colour = 0;
      for (int c = 0; c < 3; ++c) colour |= static_cast<uint32_t>((sums[c] + weights / 2) / weights) << 8 * c;
      t.set(x, y, colour, static_cast<uint32_t>(depth / weights));
    }
}

inline void smooth_plainly(OwnTile& t, int grow) {
  const OwnTile before = t;
  const auto same = [&](int x, int y, int i, int j) {
    const int64_t a = before.info(x, y), b = before.info(i, j);
    return std::abs(a - b) <= int64_t{splat::kEdge} * 256;
  };
  const auto weight = [&](int x, int y) {  // of a neighbour, the centre's being 8 - 2 of them
    const int spacing = static_cast<int>(before.info(x, y) >> 3 & 3);
    return spacing == 0 ? 0 : spacing == 1 ? 1 : 2;
  };
  const auto along = [&](int x, int y, int c) {
    const int w = weight(x, y), centre = channel(before.colour(x, y), c);
    int sum = (8 - 2 * w) * centre;
    for (const int i : {x - 1, x + 1}) sum += w * (same(x, y, i, y) ? channel(before.colour(i, y), c) : centre);
    return sum;
  };
  for (int y = -grow; y < t.tile.height + grow; ++y)
    for (int x = -grow; x < t.tile.width + grow; ++x) {
      uint32_t colour = 0;
      const int w = weight(x, y);
      for (int c = 0; c < 3; ++c) {
        int sum = (8 - 2 * w) * along(x, y, c);
        for (const int j : {y - 1, y + 1}) sum += w * (same(x, y, x, j) ? along(x, j, c) : along(x, y, c));
        colour |= static_cast<uint32_t>((sum + 32) / 64) << 8 * c;
      }
      t.tile.colour(y)[x] = colour;
    }
}

inline void antialias_plainly(OwnTile& t) {
  const OwnTile before = t;
  for (int y = 0; y < t.tile.height; ++y)
    for (int x = 0; x < t.tile.width; ++x) {
      int64_t least = INT64_MAX, most = 0;
      int sums[3] = {};
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
          const int64_t info = before.info(x + i, y + j);
          least = std::min(least, info), most = std::max(most, info);
          for (int c = 0; c < 3; ++c) sums[c] += (i ? 1 : 2) * (j ? 1 : 2) * channel(before.colour(x + i, y + j), c);
        }
      if (most - least <= int64_t{2} * splat::kEdge * 256) continue;
      uint32_t colour = 0;
      for (int c = 0; c < 3; ++c) colour |= static_cast<uint32_t>((sums[c] + 8) / 16) << 8 * c;
      t.tile.colour(y)[x] = colour;
    }
}

}  // namespace telesplat::testing
