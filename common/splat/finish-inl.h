// Included once a target, by finish.cpp. finish.h defines the stages.
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

// ---- content ----

ResolvedTile FindContent(const ResolvedTile& tile, int reach) {
  const U32 d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto nothing = hn::Set(d, kEmptyInfo);
  int left = tile.width + reach, right = -reach, top = tile.height + reach, bottom = -reach;
  for (int y = -reach; y < tile.height + reach; ++y) {
    const uint32_t* info = tile.info(y);
    const auto empty = [&](int x) HWY_ATTR { return hn::AllTrue(d, hn::Eq(hn::LoadU(d, info + x), nothing)); };
    int first = -reach;
    while (first < tile.width + reach && empty(first)) first += lanes;
    if (first >= tile.width + reach) continue;
    left = std::min(left, first);
    top = std::min(top, y);
    bottom = y + 1;
    // Looks from the right only as far as the content's known right edge.
    int last = tile.width + reach;
    while (last > right && empty(last - lanes)) last -= lanes;
    right = std::max(right, last);
  }
  const int x0 = std::max(left - kFillReach, 0), x1 = std::min(right + kFillReach, tile.width);
  const int y0 = std::max(top - kFillReach, 0), y1 = std::min(bottom + kFillReach, tile.height);
  ResolvedTile out = tile;
  out.rows += static_cast<ptrdiff_t>(y0) * 2 * tile.stride + x0;
  out.width = std::max(x1 - x0, 0), out.height = std::max(y1 - y0, 0);
  return out;
}

// ---- fill ----

// Calls visit(x offset, y offset, true if the neighbour shares a side) for the eight neighbours.
template <class Visit>
HWY_INLINE void ForNeighbours(const Visit& visit) {
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i)
      if (i != 0 || j != 0) visit(i, j, i == 0 || j == 0);
}

// The holes that have enough supports, and the info that their supports lie within kEdge of.
struct Closing {
  hn::Mask<U32> holes;
  hn::Vec<U32> target;
};
HWY_INLINE Closing FindSupports(const ResolvedTile& tile, int x, int y, hn::Vec<U32> closed, hn::Mask<U32> holes,
                                Gaps gaps) {
  const U32 d;
  const auto edge = hn::Set(d, kEdgeInfo), one = hn::Set(d, 1u), own = hn::LoadU(d, tile.info(y) + x);
  auto count = hn::Zero(d), weights = count, between = count, most = count, farthest = count,
       least = hn::Set(d, kEmptyInfo);
  ForNeighbours([&](int i, int j, bool side) HWY_ATTR {
    const auto info = hn::LoadU(d, tile.info(y + j) + x + i), weight = side ? hn::Add(one, one) : one;
    const auto apart = hn::Gt(Difference(info, closed), edge);
    count = hn::Add(count, hn::IfThenZeroElse(apart, one));
    weights = hn::Add(weights, hn::IfThenZeroElse(apart, weight));
    least = hn::Min(least, hn::IfThenElse(apart, least, info));
    most = hn::Max(most, hn::IfThenZeroElse(apart, info));
    const auto nearer = hn::Gt(hn::Sub(hn::Max(own, info), info), edge);
    between = hn::Add(between, hn::IfThenElseZero(nearer, weight));
    farthest = hn::Max(farthest, hn::IfThenElseZero(nearer, info));
  });
  if (gaps == Gaps::kAll) return {hn::AndNot(hn::Gt(hn::Set(d, kFillSupports), count), holes), closed};
  const auto uneven = hn::Gt(hn::Sub(hn::Max(most, least), least), hn::Set(d, kFlat << 8));
  const auto needed = hn::IfThenElse(uneven, hn::Set(d, kPinHoleSupports), hn::Set(d, kFlatSupports));
  const auto few = hn::Gt(needed, weights), some = hn::Gt(hn::Set(d, kBetweenSupports), between);
  return {hn::AndNot(hn::And(few, some), holes), hn::IfThenElse(few, farthest, closed)};
}

// Closes the holes of one vector of pixels.
HWY_INLINE void CloseHoles(const ResolvedTile& tile, int x, int y, const Closing& closing, int end,
                           FinishScratch& scratch) {
  const U32 d;
  const hn::RebindToFloat<U32> df;
  const hn::RebindToSigned<U32> di;
  const auto edge = hn::Set(d, kEdgeInfo);
  const auto even = hn::Set(d, 0x00ff00ffu), low = hn::Set(d, 255u);
  auto red_blue = hn::Zero(d), green = hn::Zero(d), depth = hn::Zero(d), weights = hn::Zero(d);
  ForNeighbours([&](int i, int j, bool side) HWY_ATTR {
    const auto info = hn::LoadU(d, tile.info(y + j) + x + i), colour = hn::LoadU(d, tile.colour(y + j) + x + i);
    const auto apart = hn::Gt(Difference(info, closing.target), edge);
    // Weighs neighbours at corners once, at sides twice.
    const auto rb = hn::IfThenZeroElse(apart, hn::And(colour, even));
    const auto g = hn::IfThenZeroElse(apart, hn::And(hn::ShiftRight<8>(colour), low));
    const auto z = hn::IfThenZeroElse(apart, hn::ShiftRight<8>(info));
    const auto one = hn::IfThenZeroElse(apart, hn::Set(d, 1u));
    red_blue = hn::Add(red_blue, side ? hn::Add(rb, rb) : rb);
    green = hn::Add(green, side ? hn::Add(g, g) : g);
    depth = hn::Add(depth, side ? hn::Add(z, z) : z);
    weights = hn::Add(weights, side ? hn::Add(one, one) : one);
  });
  // Quotients of integers below 2^24 are exact: one that is not whole is at least 1 / 12 away from a whole number.
  const auto divisor = hn::ConvertTo(df, hn::BitCast(di, hn::Max(weights, hn::Set(d, 1u))));
  const auto over = [&](hn::Vec<U32> v) HWY_ATTR {
    return hn::BitCast(d, hn::ConvertTo(di, hn::Div(hn::ConvertTo(df, hn::BitCast(di, v)), divisor)));
  };
  const auto half = hn::ShiftRight<1>(weights);
  const auto red = over(hn::Add(hn::ShiftRight<16>(red_blue), half));
  const auto blue = over(hn::Add(hn::And(red_blue, hn::Set(d, 0xffffu)), half));
  const auto colour = hn::Or(hn::Or(hn::ShiftLeft<16>(red), blue), hn::ShiftLeft<8>(over(hn::Add(green, half))));
  HWY_ALIGN uint32_t colours[hwy::HWY_NAMESPACE::MaxLanes(U32())], infos[hwy::HWY_NAMESPACE::MaxLanes(U32())],
      wanted[hwy::HWY_NAMESPACE::MaxLanes(U32())];
  hn::Store(colour, d, colours);
  hn::Store(hn::ShiftLeft<8>(over(depth)), d, infos);
  hn::Store(hn::VecFromMask(d, closing.holes), d, wanted);
  const int lanes = std::min(static_cast<int>(hn::Lanes(d)), end - x);
  for (int i = 0; i < lanes; ++i)
    if (wanted[i]) scratch.pixels.push_back({x + i, y, colours[i], infos[i]});
}

int FillHoles(const ResolvedTile& tile, int grow, Gaps gaps, FinishScratch& scratch) {
  const U32 d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto edge = hn::Set(d, kEdgeInfo);
  const int first = -grow, end = tile.width + grow;
  // Rows y - 1, y, y + 1 of the least code around each pixel, and of the largest of each three along the row.
  const auto row_words = static_cast<size_t>(end - first + 2 + 2 * lanes);
  scratch.rows.resize(std::max(scratch.rows.size(), 4 * row_words));
  scratch.pixels.clear();
  uint32_t* const least = scratch.rows.data();  // one row, from pixel first - 1 on
  const auto most = [&](int y) { return least + (1 + static_cast<size_t>((y + grow + 1) % 3)) * row_words; };
  const auto scan = [&](int y) HWY_ATTR {
    const uint32_t *above = tile.info(y - 1), *here = tile.info(y), *below = tile.info(y + 1);
    for (int x = first - 1; x < end + 1; x += lanes) {
      auto v = hn::Set(d, kEmptyInfo);
      for (const uint32_t* p : {above, here, below})
        v = hn::Min(hn::Min(v, hn::LoadU(d, p + x - 1)), hn::Min(hn::LoadU(d, p + x), hn::LoadU(d, p + x + 1)));
      hn::StoreU(v, d, least + (x - first + 1));
    }
    uint32_t* out = most(y);
    for (int x = 0; x < end - first; x += lanes) {
      const auto v = hn::Max(hn::LoadU(d, least + x), hn::LoadU(d, least + x + 1));
      hn::StoreU(hn::Max(v, hn::LoadU(d, least + x + 2)), d, out + x);
    }
  };
  scan(-grow - 1);
  scan(-grow);
  for (int y = -grow; y < tile.height + grow; ++y) {
    scan(y + 1);
    const uint32_t *above = most(y - 1), *here = most(y), *below = most(y + 1), *info = tile.info(y);
    for (int x = first; x < end; x += lanes) {
      const int at = x - first;
      const auto closed = hn::Max(hn::Max(hn::LoadU(d, above + at), hn::LoadU(d, here + at)), hn::LoadU(d, below + at));
      const auto own = hn::LoadU(d, info + x);
      const auto holes = hn::Gt(hn::Sub(hn::Max(own, closed), closed), edge);
      if (hn::AllFalse(d, holes)) continue;
      const Closing closing = FindSupports(tile, x, y, closed, holes, gaps);
      if (!hn::AllFalse(d, closing.holes)) CloseHoles(tile, x, y, closing, end, scratch);
    }
  }
  for (const auto& p : scratch.pixels) tile.colour(p.y)[p.x] = p.colour, tile.info(p.y)[p.x] = p.info;
  return static_cast<int>(scratch.pixels.size());
}

// ---- smooth ----

// Colour channels in 16-bit fields: red and blue, and green.
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

// Returns 8 times the centre smoothed with its two neighbours, by its spacing class.
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
  scratch.rows.resize(std::max(scratch.rows.size(), 6 * row_words));
  // Rows y - 1, y and y + 1, smoothed along the row: red and blue, then green.
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

// Weighted sums of the near pixels and of all: red and blue, and green, with the sum of weights above it.
struct Sums {
  Channels near, all;
};
// Sums three neighbours in a row with weights [1 2 1]. colour, info: point to the left one.
HWY_INLINE Sums SumRow(const uint32_t* colour, const uint32_t* info, hn::Vec<U32> least) {
  const U32 d;
  const auto edge = hn::Set(d, kEdgeInfo), one = hn::Set(d, 1u << 16);
  const auto at = [&](int i) HWY_ATTR {
    const auto far = hn::VecFromMask(d, hn::Gt(hn::Sub(hn::LoadU(d, info + i), least), edge));
    Channels c = Split(hn::LoadU(d, colour + i));
    c.green = hn::Or(c.green, one);
    return Sums{{hn::AndNot(far, c.red_blue), hn::AndNot(far, c.green)}, c};
  };
  const Sums left = at(0), middle = at(1), right = at(2);
  return {Add(Add(left.near, right.near), Times<1>(middle.near)), Add(Add(left.all, right.all), Times<1>(middle.all))};
}

// Blends a vector of pixels from the 3x3 around each, by the share that near pixels cover.
//   colours, infos: of the pixel to the left, in the rows above, of the pixel and below.
HWY_INLINE hn::Vec<U32> Blend(const uint32_t* const colours[3], const uint32_t* const infos[3], hn::Vec<U32> least) {
  const U32 d;
  const Sums above = SumRow(colours[0], infos[0], least), here = SumRow(colours[1], infos[1], least),
             below = SumRow(colours[2], infos[2], least);
  const Channels near = Add(Add(above.near, below.near), Times<1>(here.near)),
                 all = Add(Add(above.all, below.all), Times<1>(here.all));
  const Channels far{hn::Sub(all.red_blue, near.red_blue), hn::Sub(all.green, near.green)};
  const auto is_far = hn::Gt(hn::Sub(hn::LoadU(d, infos[1] + 1), least), hn::Set(d, kEdgeInfo));
  const auto row = hn::IfThenZeroElse(is_far, hn::Set(d, 17u));
  const auto index = hn::BitCast(hn::RebindToSigned<U32>(), hn::Add(hn::ShiftRight<16>(near.green), row));
  const auto of_near = hn::GatherIndex(d, kCoverageWeights.near.data(), index),
             of_far = hn::GatherIndex(d, kCoverageWeights.far.data(), index);
  const auto mean = [&](hn::Vec<U32> n, hn::Vec<U32> f) HWY_ATTR {
    return hn::ShiftRight<16>(hn::Add(hn::Add(hn::Mul(n, of_near), hn::Mul(f, of_far)), hn::Set(d, 0x8000u)));
  };
  const auto low = hn::Set(d, 0xffffu);
  const auto red = mean(hn::ShiftRight<16>(near.red_blue), hn::ShiftRight<16>(far.red_blue)),
             green = mean(hn::And(near.green, low), hn::And(far.green, low)),
             blue = mean(hn::And(near.red_blue, low), hn::And(far.red_blue, low));
  return hn::Or(hn::Or(hn::ShiftLeft<16>(red), hn::ShiftLeft<8>(green)), blue);
}

void Antialias(const ResolvedTile& tile, FinishScratch& scratch) {
  const U32 d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto edge = hn::Set(d, 2 * kEdgeInfo);
  // Vectors with silhouettes: written after all have been read.
  scratch.places.clear();
  scratch.rows.resize(std::max(scratch.rows.size(), static_cast<size_t>(tile.height) * (tile.width + lanes)));
  uint32_t* blended = scratch.rows.data();
  for (int y = 0; y < tile.height; ++y) {
    const uint32_t *above = tile.info(y - 1), *here = tile.info(y), *below = tile.info(y + 1);
    for (int x = 0; x < tile.width; x += lanes) {
      auto least = hn::Set(d, kEmptyInfo), most = hn::Zero(d);
      for (const uint32_t* p : {above, here, below})
        for (int i = -1; i <= 1; ++i) {
          const auto info = hn::LoadU(d, p + x + i);
          least = hn::Min(least, info), most = hn::Max(most, info);
        }
      const auto silhouette = hn::Gt(hn::Sub(most, least), edge);
      if (hn::AllFalse(d, silhouette)) continue;
      const uint32_t* const colours[3] = {tile.colour(y - 1) + x - 1, tile.colour(y) + x - 1,
                                          tile.colour(y + 1) + x - 1};
      const uint32_t* const infos[3] = {above + x - 1, here + x - 1, below + x - 1};
      const auto mask = hn::And(silhouette, hn::FirstN(d, static_cast<size_t>(tile.width - x)));
      hn::StoreU(hn::IfThenElse(mask, Blend(colours, infos, least), hn::LoadU(d, colours[1] + 1)), d, blended);
      blended += lanes;
      scratch.places.push_back(tile.colour(y) + x);
    }
  }
  blended = scratch.rows.data();
  for (uint32_t* place : scratch.places) {
    hn::StoreU(hn::LoadU(d, blended), d, place);
    blended += lanes;
  }
}

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
