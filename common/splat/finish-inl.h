// Included once a target, by finish.cpp. The definition stands in finish.h.
#if defined(TELESPLAT_FINISH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_FINISH_INL_H_
#undef TELESPLAT_FINISH_INL_H_
#else
#define TELESPLAT_FINISH_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>

#include "common/splat/finish.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using U32 = hn::ScalableTag<uint32_t>;

constexpr uint32_t kEdgeInfo = kEdge << 8;

HWY_INLINE hn::Vec<U32> Difference(hn::Vec<U32> a, hn::Vec<U32> b) { return hn::Sub(hn::Max(a, b), hn::Min(a, b)); }

// ---- fill ----

struct Support {
  uint32_t colour = 0, info = kEmptyInfo;
  int distance = 0;  // 0: none
};

inline Support FindSupport(const ResolvedTile& tile, int x, int y, int dx, int dy, uint32_t hole) {
  for (int r = 1; r <= kFillRadius; ++r) {
    const uint32_t info = tile.info(y + r * dy)[x + r * dx];
    if (info < hole && hole - info > kEdgeInfo) return {tile.colour(y + r * dy)[x + r * dx], info, r};
  }
  return {};
}

// True if the hole at (x, y) is to be closed, with what.
inline bool CloseHole(const ResolvedTile& tile, int x, int y, FinishScratch::Pixel& out) {
  constexpr int kAxes[4][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};
  constexpr uint32_t kWeight[kFillRadius + 1] = {0, 36, 9, 4};  // 36 / distance^2
  const uint32_t hole = tile.info(y)[x];
  Support pairs[4][2];
  uint32_t nearest[4];
  int count = 0;
  for (const auto& axis : kAxes) {
    const Support a = FindSupport(tile, x, y, axis[0], axis[1], hole);
    if (a.distance == 0) continue;
    const Support b = FindSupport(tile, x, y, -axis[0], -axis[1], hole);
    if (b.distance == 0 || a.distance + b.distance > kFillRadius + 1) continue;
    if (std::max(a.info, b.info) - std::min(a.info, b.info) >
        kEdgeInfo * static_cast<uint32_t>(a.distance + b.distance))
      continue;
    pairs[count][0] = a, pairs[count][1] = b;
    nearest[count++] = std::min(a.info, b.info);
  }
  if (count == 0) return false;
  const uint32_t limit = *std::min_element(nearest, nearest + count) + 2 * kEdgeInfo;
  uint32_t weights = 0, red = 0, green = 0, blue = 0;
  uint64_t depth = 0;
  int used = 0;
  bool tight = false;
  for (int i = 0; i < count; ++i) {
    if (nearest[i] > limit) continue;
    ++used;
    tight |= pairs[i][0].distance + pairs[i][1].distance == 2;
    for (const Support& s : pairs[i]) {
      const uint32_t w = kWeight[s.distance];
      weights += w;
      red += w * (s.colour >> 16 & 255), green += w * (s.colour >> 8 & 255), blue += w * (s.colour & 255);
      depth += uint64_t{w} * (s.info >> 8);
    }
  }
  if (used < 2 && !tight) return false;
  const uint32_t half = weights / 2;
  out.colour = (red + half) / weights << 16 | (green + half) / weights << 8 | (blue + half) / weights;
  out.info = static_cast<uint32_t>(depth / weights) << 8;
  return true;
}

int FillHoles(const ResolvedTile& tile, int grow, FinishScratch& scratch) {
  const U32 d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto edge = hn::Set(d, kEdgeInfo);
  scratch.pixels.clear();
  const int end = tile.width + grow;
  for (int y = -grow; y < tile.height + grow; ++y) {
    const uint32_t *above = tile.info(y - 1), *here = tile.info(y), *below = tile.info(y + 1);
    for (int x = -grow; x < end; x += lanes) {
      const auto info = hn::LoadU(d, here + x);
      const auto sides = hn::Min(hn::LoadU(d, here + x - 1), hn::LoadU(d, here + x + 1));
      const auto nearest = hn::Min(sides, hn::Min(hn::LoadU(d, above + x), hn::LoadU(d, below + x)));
      // info - nearest > edge where info > nearest; a surface as far as codes go is still nearer than nothing.
      const auto gap = hn::Sub(hn::Max(info, nearest), nearest);
      if (hn::AllFalse(d, hn::Gt(gap, edge))) continue;
      for (int i = x; i < std::min(x + lanes, end); ++i) {
        const uint32_t n = std::min(std::min(here[i - 1], here[i + 1]), std::min(above[i], below[i]));
        if (here[i] <= n || here[i] - n <= kEdgeInfo) continue;
        FinishScratch::Pixel p{i, y, 0, 0};
        if (CloseHole(tile, i, y, p)) scratch.pixels.push_back(p);
      }
    }
  }
  for (const auto& p : scratch.pixels) tile.colour(p.y)[p.x] = p.colour, tile.info(p.y)[p.x] = p.info;
  return static_cast<int>(scratch.pixels.size());
}

// ---- smooth ----

// Two channels in 16-bit fields, and one.
struct Channels {
  hn::Vec<U32> red_blue, green;
};
HWY_INLINE Channels Split(hn::Vec<U32> colour) {
  const U32 d;
  return {hn::And(colour, hn::Set(d, 0x00ff00ffu)), hn::And(hn::ShiftRight<8>(colour), hn::Set(d, 255u))};
}
HWY_INLINE Channels Add(const Channels& a, const Channels& b) {
  return {hn::Add(a.red_blue, b.red_blue), hn::Add(a.green, b.green)};
}
template <int kBits>
HWY_INLINE Channels Times(const Channels& a) {
  return {hn::ShiftLeft<kBits>(a.red_blue), hn::ShiftLeft<kBits>(a.green)};
}
HWY_INLINE Channels Choose(hn::Mask<U32> mask, const Channels& yes, const Channels& no) {
  return {hn::IfThenElse(mask, yes.red_blue, no.red_blue), hn::IfThenElse(mask, yes.green, no.green)};
}
// (c + half) >> kBits in every field.
template <int kBits>
HWY_INLINE hn::Vec<U32> Join(const Channels& c) {
  const U32 d;
  constexpr uint32_t kHalf = 1u << (kBits - 1);
  const auto red_blue = hn::ShiftRight<kBits>(hn::Add(c.red_blue, hn::Set(d, kHalf << 16 | kHalf)));
  const auto green = hn::ShiftRight<kBits>(hn::Add(c.green, hn::Set(d, kHalf)));
  return hn::Or(hn::And(red_blue, hn::Set(d, 0x00ff00ffu)), hn::ShiftLeft<8>(hn::And(green, hn::Set(d, 255u))));
}

// 8 times the centre smoothed with its two neighbours, by its spacing class.
HWY_INLINE Channels Smooth3(const Channels& before, const Channels& centre, const Channels& after,
                            hn::Vec<U32> info_before, hn::Vec<U32> info, hn::Vec<U32> info_after) {
  const U32 d;
  const auto edge = hn::Set(d, kEdgeInfo);
  const Channels b = Choose(hn::Gt(Difference(info, info_before), edge), centre, before);
  const Channels a = Choose(hn::Gt(Difference(info, info_after), edge), centre, after);
  const Channels four = Add(Add(b, a), Times<1>(centre));
  const auto spacing = hn::And(info, hn::Set(d, 3u << 3));
  const Channels magnified = Choose(hn::Gt(spacing, hn::Set(d, 1u << 3)), Times<1>(four), Add(four, Times<2>(centre)));
  return Choose(hn::Eq(spacing, hn::Zero(d)), Times<3>(centre), magnified);
}

void Smooth(const ResolvedTile& tile, int grow, FinishScratch& scratch) {
  const U32 d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const int first = -grow, end = tile.width + grow;
  const auto row_words = static_cast<size_t>(end - first + lanes);
  scratch.rows.resize(6 * row_words);
  // Rows y - 1, y and y + 1 smoothed along themselves: red and blue, then green.
  const auto row = [&](int y) { return scratch.rows.data() + static_cast<size_t>((y + grow + 1) % 3) * 2 * row_words; };
  const auto along = [&](int y) HWY_ATTR {
    const uint32_t *colour = tile.colour(y), *info = tile.info(y);
    uint32_t* out = row(y);
    for (int x = first; x < end; x += lanes) {
      const Channels c = Smooth3(Split(hn::LoadU(d, colour + x - 1)), Split(hn::LoadU(d, colour + x)),
                                 Split(hn::LoadU(d, colour + x + 1)), hn::LoadU(d, info + x - 1),
                                 hn::LoadU(d, info + x), hn::LoadU(d, info + x + 1));
      hn::StoreU(c.red_blue, d, out + (x - first));
      hn::StoreU(c.green, d, out + row_words + (x - first));
    }
  };
  const auto load = [&](int y, int x) HWY_ATTR {
    const uint32_t* p = row(y) + (x - first);
    return Channels{hn::LoadU(d, p), hn::LoadU(d, p + row_words)};
  };
  along(-grow - 1);
  along(-grow);
  for (int y = -grow; y < tile.height + grow; ++y) {
    along(y + 1);
    uint32_t* colour = tile.colour(y);
    const uint32_t *above = tile.info(y - 1), *here = tile.info(y), *below = tile.info(y + 1);
    for (int x = first; x < end; x += lanes) {
      const Channels c = Smooth3(load(y - 1, x), load(y, x), load(y + 1, x), hn::LoadU(d, above + x),
                                 hn::LoadU(d, here + x), hn::LoadU(d, below + x));
      hn::StoreU(Join<6>(c), d, colour + x);
    }
  }
}

// ---- antialias ----

void Antialias(const ResolvedTile& tile, FinishScratch& scratch) {
  const U32 d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto edge = hn::Set(d, 2 * kEdgeInfo);
  HWY_ALIGN uint32_t blended[hwy::HWY_NAMESPACE::MaxLanes(U32())];
  HWY_ALIGN uint32_t range[hwy::HWY_NAMESPACE::MaxLanes(U32())];
  scratch.pixels.clear();
  for (int y = 0; y < tile.height; ++y) {
    const uint32_t *above = tile.info(y - 1), *here = tile.info(y), *below = tile.info(y + 1);
    for (int x = 0; x < tile.width; x += lanes) {
      auto least = hn::Set(d, kEmptyInfo), most = hn::Zero(d);
      for (const uint32_t* p : {above, here, below})
        for (int i = -1; i <= 1; ++i) {
          const auto info = hn::LoadU(d, p + x + i);
          least = hn::Min(least, info), most = hn::Max(most, info);
        }
      const auto gap = hn::Sub(most, least);
      if (hn::AllFalse(d, hn::Gt(gap, edge))) continue;
      Channels sum{hn::Zero(d), hn::Zero(d)};
      for (int j = -1; j <= 1; ++j) {
        const uint32_t* c = tile.colour(y + j) + x;
        const Channels line =
            Add(Add(Split(hn::LoadU(d, c - 1)), Split(hn::LoadU(d, c + 1))), Times<1>(Split(hn::LoadU(d, c))));
        sum = Add(sum, j == 0 ? Times<1>(line) : line);
      }
      hn::Store(Join<4>(sum), d, blended);
      hn::Store(gap, d, range);
      for (int i = 0; i < std::min(lanes, tile.width - x); ++i)
        if (range[i] > 2 * kEdgeInfo) scratch.pixels.push_back({x + i, y, blended[i], 0});
    }
  }
  for (const auto& p : scratch.pixels) tile.colour(p.y)[p.x] = p.colour;
}

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
