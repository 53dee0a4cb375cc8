// The finish pixel by pixel, written from its definition in common/splat/finish.h: slow, and shares no code with it.
#pragma once

#include <cstdlib>
#include <vector>

#include "common/splat/finish.h"

namespace telesplat::testing {

/// A tile that owns its pixels, all empty at first.
struct OwnTile {
  OwnTile(int width, int height, int margin = splat::kFillReach + 3 + splat::kFinishSlack)
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

inline int channel(uint32_t colour, int c) { return static_cast<int>(colour >> 8 * c & 255); }

inline void fill_plainly(OwnTile& t, int grow, splat::Gaps gaps) {
  const OwnTile before = t;
  // Compares whole infos, not only codes: the bits below the code count too.
  const int64_t edge = int64_t{splat::kEdge} * 256;
  const auto code = [&](int x, int y) { return static_cast<int64_t>(before.info(x, y)); };
  const auto least = [&](int x, int y) {
    int64_t v = INT64_MAX;
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) v = std::min(v, code(x + i, y + j));
    return v;
  };
  for (int y = -grow; y < t.tile.height + grow; ++y)
    for (int x = -grow; x < t.tile.width + grow; ++x) {
      int64_t closed = 0;
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) closed = std::max(closed, least(x + i, y + j));
      if (code(x, y) - closed <= edge) continue;
      const auto neighbours = [&](const auto& visit) {
        for (int j = -1; j <= 1; ++j)
          for (int i = -1; i <= 1; ++i)
            if (i != 0 || j != 0) visit(x + i, y + j, i == 0 || j == 0 ? 2 : 1);
      };
      int count = 0, weights = 0, between = 0;
      int64_t nearest = INT64_MAX, farthest = 0, behind = 0;
      neighbours([&](int i, int j, int w) {
        if (code(x, y) - code(i, j) > edge) between += w, behind = std::max(behind, code(i, j));
        if (std::abs(code(i, j) - closed) > edge) return;
        ++count, weights += w;
        nearest = std::min(nearest, code(i, j)), farthest = std::max(farthest, code(i, j));
      });
      const bool flat = farthest - nearest <= int64_t{splat::kFlat} * 256;
      const int needed = static_cast<int>(flat ? splat::kFlatSupports : splat::kPinHoleSupports);
      const bool all = gaps == splat::Gaps::kAll;
      const bool enough = all ? count >= static_cast<int>(splat::kFillSupports) : weights >= needed;
      if (!enough && (all || between < static_cast<int>(splat::kBetweenSupports))) continue;
      const int64_t target = enough ? closed : behind;
      int sums[3] = {};
      int64_t depth = 0;
      weights = 0;
      neighbours([&](int i, int j, int w) {
        if (std::abs(code(i, j) - target) > edge) return;
        weights += w;
        for (int c = 0; c < 3; ++c) sums[c] += w * channel(before.colour(i, j), c);
        depth += w * (code(i, j) >> 8);
      });
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
  const auto weight = [&](int x, int y) {  // weight of a neighbour; the centre has 8 - 2 * weight
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
  const int64_t edge = int64_t{splat::kEdge} * 256;
  for (int y = 0; y < t.tile.height; ++y)
    for (int x = 0; x < t.tile.width; ++x) {
      int64_t least = INT64_MAX, most = 0;
      const auto each = [&](const auto& visit) {
        for (int j = -1; j <= 1; ++j)
          for (int i = -1; i <= 1; ++i) visit(int64_t{before.info(x + i, y + j)}, i, j);
      };
      each([&](int64_t info, int, int) { least = std::min(least, info), most = std::max(most, info); });
      if (most - least <= 2 * edge) continue;
      uint32_t near[3] = {}, far[3] = {}, weight = 0;
      each([&](int64_t info, int i, int j) {
        const uint32_t w = (i ? 1 : 2) * (j ? 1 : 2);
        const bool is_near = info - least <= edge;
        if (is_near) weight += w;
        for (int c = 0; c < 3; ++c) (is_near ? near : far)[c] += w * (before.colour(x + i, y + j) >> 8 * c & 255);
      });
      const uint32_t kind = weight + (before.info(x, y) - least <= edge ? 17 : 0);
      uint32_t colour = 0;
      for (int c = 0; c < 3; ++c)
        colour |=
            (near[c] * splat::kCoverageWeights.near[kind] + far[c] * splat::kCoverageWeights.far[kind] + 0x8000) >>
            16 << 8 * c;
      t.tile.colour(y)[x] = colour;
    }
}

}  // namespace telesplat::testing
