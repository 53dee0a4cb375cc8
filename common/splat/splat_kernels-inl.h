// Included once a target, by splat_kernels.cpp.
#if defined(TELESPLAT_SPLAT_KERNELS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SPLAT_KERNELS_INL_H_
#undef TELESPLAT_SPLAT_KERNELS_INL_H_
#else
#define TELESPLAT_SPLAT_KERNELS_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "common/splat/splat_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F32 = hn::ScalableTag<float>;
using I32 = hn::RebindToSigned<F32>;
using U32 = hn::RebindToUnsigned<F32>;
using U16 = hn::Rebind<uint16_t, F32>;

constexpr size_t kBatch = 512;      // projected points held before they are splatted: their arrays stay in the first-level cache
constexpr size_t kMaxLanes = 64;    // float lanes of the widest vectors there are
constexpr size_t kPiece = 384;      // points of an item taken at once: room for a whole piece is made before it is projected

// Points of one level, from `offset` on, padded with copies of nothing in particular where fewer than a vector are left.
struct Lanes {
  hn::Vec<F32> x, y, z;
};

HWY_INLINE hn::Vec<F32> ToFloat(const uint16_t* p) {
  return hn::ConvertTo(F32(), hn::BitCast(I32(), hn::PromoteTo(U32(), hn::LoadU(U16(), p))));
}

HWY_INLINE Lanes LoadLanes(const points::Mosaic::Level& level, size_t offset) {
  return {ToFloat(level.x + offset), ToFloat(level.y + offset), ToFloat(level.z + offset)};
}

HWY_INLINE hn::Vec<F32> Row(const std::array<float, 4>& row, const Lanes& p) {
  const F32 d;
  const auto xy = hn::Add(hn::Mul(p.x, hn::Set(d, row[0])), hn::Mul(p.y, hn::Set(d, row[1])));
  return hn::Add(hn::Add(xy, hn::Mul(p.z, hn::Set(d, row[2]))), hn::Set(d, row[3]));
}

// floor(v), as integers; what does not fit lies far outside every image and must only stay outside.
HWY_INLINE hn::Vec<I32> FloorToInt(hn::Vec<F32> v) {
  const F32 d;
  const auto limit = hn::Set(d, 1e6f);
  return hn::ConvertTo(I32(), hn::Floor(hn::Max(hn::Min(v, limit), hn::Neg(limit))));
}

struct Projected {
  hn::Vec<I32> x, y;  // 2^-sub_bits pixels
  hn::Vec<F32> w;
};

HWY_INLINE Projected Project(const LeafTransform& t, const Lanes& p, float near_m, float scale, float shift) {
  const F32 d;
  const auto w = Row(t.w, p);
  const auto inverse = hn::Div(hn::Set(d, scale), hn::Max(w, hn::Set(d, near_m)));
  const auto s = hn::Set(d, shift);
  return {FloorToInt(hn::Add(hn::Mul(Row(t.x, p), inverse), s)), FloorToInt(hn::Add(hn::Mul(Row(t.y, p), inverse), s)), w};
}

// image::Shading::apply on each lane: (c * i + 127) / 255 for each channel; v / 255 = (v + 1 + (v >> 8)) >> 8 for v < 65535.
HWY_INLINE hn::Vec<U32> Shade(hn::Vec<U32> albedo, hn::Vec<U32> i) {
  const U32 d;
  const auto red_blue = hn::Set(d, 0x00ff00ff), green = hn::Set(d, 0x000000ff);
  const auto rb = hn::Add(hn::Mul(hn::And(albedo, red_blue), i), hn::Set(d, 0x007f007f));
  const auto g = hn::Add(hn::Mul(hn::And(hn::ShiftRight<8>(albedo), green), i), hn::Set(d, 0x7f));
  const auto rb_over = hn::Add(hn::Add(rb, hn::Set(d, 0x00010001)), hn::And(hn::ShiftRight<8>(rb), red_blue));
  const auto g_over = hn::Add(hn::Add(g, hn::Set(d, 1)), hn::ShiftRight<8>(g));
  return hn::Or(hn::And(hn::ShiftRight<8>(rb_over), red_blue), hn::And(g_over, hn::Set(d, 0xff00)));
}

// A level of fewer points than a vector has lanes, where whole vectors can be read.
class ShortLevel {
 public:
  points::Mosaic::Level copy(const points::Mosaic::Level& level) {
    const size_t n = level.count;
    std::memcpy(x_, level.x, n * 2);
    std::memcpy(y_, level.y, n * 2);
    std::memcpy(z_, level.z, n * 2);
    std::memcpy(normal_, level.normal, n * 2);
    std::memcpy(colour_, level.colour, n * 4);
    return {level.count, x_, y_, z_, normal_, colour_};
  }

 private:
  uint16_t x_[kMaxLanes] = {}, y_[kMaxLanes] = {}, z_[kMaxLanes] = {}, normal_[kMaxLanes] = {};
  uint32_t colour_[kMaxLanes] = {};
};

// Calls visit(level, offset, skip, valid) for vectors that cover points [first, last) of a level: lanes skip..valid-1 are
// points not visited yet. The last vector overlaps the one before, so that nothing is read beyond the arrays.
template <class Visit>
HWY_INLINE void ForVectors(const points::Mosaic::Level& level, size_t first, size_t last, ShortLevel& scratch, const Visit& visit) {
  const size_t lanes = hn::Lanes(F32());
  size_t i = first;
  for (; i + lanes <= last; i += lanes) visit(level, i, size_t{0}, lanes);
  if (i == last) return;
  if (last >= lanes) visit(level, last - lanes, i - (last - lanes), lanes);
  else visit(scratch.copy(level), i, size_t{0}, last - i);
}

// Projected points, waiting to be splatted.
struct Batch {
  // Where: index of the first pixel << 2 sub_bits | sub_y << sub_bits | sub_x.
  HWY_ALIGN uint32_t place[kBatch + kMaxLanes];
  HWY_ALIGN uint64_t key[kBatch + kMaxLanes];
  size_t count = 0;
};

// One row of a splat after the other, whole vectors: what lies beyond the splat's side is written back unchanged.
template <int kSide>
HWY_INLINE void SplatOne(uint64_t* HWY_RESTRICT pixels, size_t stride, const uint64_t* HWY_RESTRICT addends, int64_t key) {
  constexpr size_t kRow = (kSide + 3) / 4 * 4;
  const hn::CappedTag<int64_t, kSide <= 2 ? 2 : 4> d;
  const auto k = hn::Set(d, key);
  for (size_t y = 0; y < kSide; ++y)
    for (size_t x = 0; x < kSide; x += hn::Lanes(d)) {
      auto* p = reinterpret_cast<int64_t*>(pixels + y * stride + x);
      const auto* a = reinterpret_cast<const int64_t*>(addends + y * kRow + x);
      hn::StoreU(hn::Min(hn::LoadU(d, p), hn::Add(k, hn::LoadU(d, a))), d, p);
    }
}

template <int kSide>
void SplatBatch(const SplatShape& shape, const KeyBuffer& buffer, const Batch& batch) {
  constexpr size_t kStep = kSide * ((kSide + 3) / 4 * 4);
  const int shift = 2 * shape.sub_bits;
  const uint32_t sub_mask = (1u << shift) - 1;
  const auto stride = static_cast<size_t>(buffer.stride);
  for (size_t i = 0; i < batch.count; ++i) {
    const uint32_t place = batch.place[i];
    if constexpr (kSide == 1) {
      auto& pixel = reinterpret_cast<int64_t&>(buffer.keys[place]);
      pixel = std::min(pixel, static_cast<int64_t>(batch.key[i]));
    } else {
      SplatOne<kSide>(buffer.keys + (place >> shift), stride, shape.addends.data() + (place & sub_mask) * kStep,
                      static_cast<int64_t>(batch.key[i]));
    }
  }
}

using SplatBatchFunction = void (*)(const SplatShape&, const KeyBuffer&, const Batch&);
constexpr SplatBatchFunction kSplatBatch[kMaxSplatSide] = {
    SplatBatch<1>,  SplatBatch<2>,  SplatBatch<3>,  SplatBatch<4>,  SplatBatch<5>,  SplatBatch<6>,  SplatBatch<7>,  SplatBatch<8>,
    SplatBatch<9>,  SplatBatch<10>, SplatBatch<11>, SplatBatch<12>, SplatBatch<13>, SplatBatch<14>, SplatBatch<15>, SplatBatch<16>};

class TileSplatter {
 public:
  TileSplatter(const TileInput& input, const uint8_t* intensity, const KeyBuffer& buffer)
      : input_(input), intensity_(intensity), buffer_(buffer) {}

  TileCounts run(const SplatShape* const* shapes) {
    for (const TileBinning::Entry& entry : input_.entries) {
      const ItemRun run = input_.runs[entry.box];
      for (uint32_t i = run.first; i < run.last; ++i) {
        if (shapes[i] != shape_) {
          flush();
          shape_ = shapes[i];
        }
        if (entry.whole) add<true>(input_.transforms[entry.box], input_.items[i].level);
        else add<false>(input_.transforms[entry.box], input_.items[i].level);
      }
    }
    flush();
    return counts_;
  }

 private:
  void flush() {
    if (batch_.count > 0) kSplatBatch[shape_->side - 1](*shape_, buffer_, batch_);
    batch_.count = 0;
  }

  template <bool kWhole>
  void add(const LeafTransform& transform, const points::Mosaic::Level& level) {
    counts_.projected += level.count;
    if (kWhole) counts_.drawn += level.count;
    for (size_t first = 0; first < level.count; first += kPiece) {
      const size_t last = std::min<size_t>(first + kPiece, level.count);
      if (batch_.count + (last - first) > kBatch) flush();
      ForVectors(level, first, last, scratch_,
                 [&](const points::Mosaic::Level& l, size_t offset, size_t skip, size_t valid) HWY_ATTR {
                   add_vector<kWhole>(transform, l, offset, skip, valid);
                 });
    }
  }

  template <bool kWhole>
  HWY_INLINE void add_vector(const LeafTransform& transform, const points::Mosaic::Level& level, size_t offset, size_t skip,
                             size_t valid) {
    const I32 di;
    const U32 du;
    const int bits = shape_->sub_bits;
    const Projected p = Project(transform, LoadLanes(level, offset), input_.near_m, shape_->scale, shape_->shift);
    const auto px = hn::Sub(hn::ShiftRightSame(p.x, bits), hn::Set(di, input_.rect.x));
    const auto py = hn::Sub(hn::ShiftRightSame(p.y, bits), hn::Set(di, input_.rect.y));

    hn::Mask<I32> keep = hn::FirstN(di, valid);
    if (!kWhole) {
      const auto outside = hn::Set(di, -shape_->side);
      const auto width = hn::Set(di, input_.rect.width), height = hn::Set(di, input_.rect.height);
      const auto in_x = hn::And(hn::Gt(px, outside), hn::Lt(px, width)), in_y = hn::And(hn::Gt(py, outside), hn::Lt(py, height));
      const auto beyond_near = hn::RebindMask(di, hn::Ge(p.w, hn::Set(F32(), input_.near_m)));
      keep = hn::And(hn::AndNot(hn::FirstN(di, skip), keep), hn::And(hn::And(in_x, in_y), beyond_near));
      if (hn::AllFalse(di, keep)) return;
      const auto minus_one = hn::Set(di, -1);
      counts_.drawn += hn::CountTrue(di, hn::And(keep, hn::And(hn::Gt(px, minus_one), hn::Gt(py, minus_one))));
    }

    const auto mask = hn::Set(di, (1 << bits) - 1);
    const auto pixel = hn::Add(hn::Add(hn::Mul(py, hn::Set(di, buffer_.stride)), px),
                               hn::Set(di, buffer_.margin * (buffer_.stride + 1)));
    const auto sub = hn::Or(hn::ShiftLeftSame(hn::And(p.y, mask), bits), hn::And(p.x, mask));
    const auto place = hn::BitCast(du, hn::Or(hn::ShiftLeftSame(pixel, 2 * bits), sub));

    const auto normal = hn::BitCast(di, hn::PromoteTo(du, hn::LoadU(U16(), level.normal + offset)));
    const auto gathered = hn::GatherOffset(di, reinterpret_cast<const int32_t*>(intensity_), normal);
    const auto intensity = hn::And(hn::BitCast(du, gathered), hn::Set(du, 255));
    const auto colour = Shade(hn::LoadU(du, level.colour + offset), intensity);
    const auto depth = hn::Or(hn::BitCast(du, p.w), hn::Set(du, 0x80000000u));

    if (kWhole) {
      // Lanes below `skip` are in the batch already, as its last points: they are written again, with the same values, unless
      // the batch was emptied in between.
      const size_t at = batch_.count >= skip ? batch_.count - skip : 0;
      hn::StoreU(place, du, batch_.place + at);
      hn::StoreInterleaved2(colour, depth, du, reinterpret_cast<uint32_t*>(batch_.key + at));
      batch_.count = at + valid;
    } else {
      const auto kept = hn::RebindMask(du, keep);
      const size_t n = hn::CompressStore(place, kept, du, batch_.place + batch_.count);
      hn::StoreInterleaved2(hn::Compress(colour, kept), hn::Compress(depth, kept), du,
                            reinterpret_cast<uint32_t*>(batch_.key + batch_.count));
      batch_.count += n;
    }
  }

  const TileInput& input_;
  const uint8_t* intensity_;
  const KeyBuffer& buffer_;
  const SplatShape* shape_ = nullptr;
  TileCounts counts_;
  ShortLevel scratch_;
  Batch batch_;
};

TileCounts SplatTile(const TileInput& input, const SplatShape* const* shapes, const uint8_t* intensity, const KeyBuffer& buffer) {
  return TileSplatter(input, intensity, buffer).run(shapes);
}

void ResolvePixel(uint64_t& key, uint32_t background, uint32_t* colour, float* depth_m) {
  const auto low = static_cast<uint32_t>(key);
  const bool empty = static_cast<int64_t>(key) == kEmptyKey;
  *colour = (empty ? background : low) | 0xff000000u;
  if (depth_m) {
    const uint32_t bits = (static_cast<uint32_t>(key >> 32) & 0x7fffffffu) - (low >> 24 << kBiasShift);
    *depth_m = empty ? INFINITY : std::bit_cast<float>(bits);
  }
  key = static_cast<uint64_t>(kEmptyKey);
}

void ResolveTile(const KeyBuffer& buffer, int width, int height, uint32_t background, uint32_t* colour, float* depth_m, size_t pitch) {
  const U32 d;
  const F32 df;
  const size_t lanes = hn::Lanes(d), vector_bytes = lanes * 4;
  const auto opaque = hn::Set(d, 0xff000000u), empty_half = hn::Set(d, 0xffffffffu), paper = hn::Set(d, background);
  const auto magnitude = hn::Set(d, 0x7fffffffu), infinity = hn::Set(d, 0x7f800000u);
  for (int y = 0; y < height; ++y) {
    uint64_t* keys = buffer.keys + static_cast<size_t>(y + buffer.margin) * buffer.stride + buffer.margin;
    uint32_t* out = colour + y * pitch;
    float* out_depth = depth_m ? depth_m + y * pitch : nullptr;
    const auto n = static_cast<size_t>(width);
    size_t x = 0;
    // Up to where whole aligned vectors start: those are written past the caches, for nobody here reads them again.
    for (; x < n && reinterpret_cast<uintptr_t>(out + x) % vector_bytes != 0; ++x)
      ResolvePixel(keys[x], background, out + x, out_depth ? out_depth + x : nullptr);
    for (; x + lanes <= n; x += lanes) {
      hn::Vec<U32> low, high;
      auto* key = reinterpret_cast<uint32_t*>(keys + x);
      hn::LoadInterleaved2(d, key, low, high);
      hn::StoreU(empty_half, d, key);
      hn::StoreU(empty_half, d, key + lanes);
      const auto empty = hn::Eq(high, empty_half);
      hn::Stream(hn::Or(hn::IfThenElse(empty, paper, low), opaque), d, out + x);
      if (out_depth) {
        const auto bits = hn::Sub(hn::And(high, magnitude), hn::ShiftLeft<kBiasShift>(hn::ShiftRight<24>(low)));
        hn::StoreU(hn::BitCast(df, hn::IfThenElse(empty, infinity, bits)), df, out_depth + x);
      }
    }
    for (; x < n; ++x) ResolvePixel(keys[x], background, out + x, out_depth ? out_depth + x : nullptr);
  }
  hwy::FlushStream();
}

void DepthTile(const TileInput& input, uint32_t* depth_bits) {
  const I32 di;
  const U32 du;
  ShortLevel scratch;
  HWY_ALIGN uint32_t place[kMaxLanes];
  HWY_ALIGN uint32_t bits[kMaxLanes];
  const auto x0 = hn::Set(di, input.rect.x), y0 = hn::Set(di, input.rect.y);
  const auto width = hn::Set(di, input.rect.width), height = hn::Set(di, input.rect.height);
  const auto minus_one = hn::Set(di, -1);
  const auto near_m = hn::Set(F32(), input.near_m);
  for (const TileBinning::Entry& entry : input.entries) {
    const LeafTransform& transform = input.transforms[entry.box];
    const ItemRun run = input.runs[entry.box];
    for (uint32_t i = run.first; i < run.last; ++i) {
      const auto& level = input.items[i].level;
      ForVectors(level, 0, level.count, scratch,
                 [&](const points::Mosaic::Level& l, size_t offset, size_t, size_t valid) HWY_ATTR {
                   // A point met twice changes nothing, so lanes that overlap are not left out.
                   const Projected p = Project(transform, LoadLanes(l, offset), input.near_m, 1.0f, 0.0f);
                   const auto px = hn::Sub(p.x, x0), py = hn::Sub(p.y, y0);
                   auto at = hn::BitCast(du, hn::Add(hn::Mul(py, width), px));
                   auto depth = hn::BitCast(du, p.w);
                   size_t n = valid;
                   if (entry.whole) {
                     hn::Store(at, du, place);
                     hn::Store(depth, du, bits);
                   } else {
                     const auto in_x = hn::And(hn::Gt(px, minus_one), hn::Lt(px, width));
                     const auto in_y = hn::And(hn::Gt(py, minus_one), hn::Lt(py, height));
                     const auto beyond_near = hn::RebindMask(di, hn::Ge(p.w, near_m));
                     const auto keep = hn::RebindMask(
                         du, hn::And(hn::FirstN(di, valid), hn::And(hn::And(in_x, in_y), beyond_near)));
                     hn::CompressStore(at, keep, du, place);
                     n = hn::CompressStore(depth, keep, du, bits);
                   }
                   for (size_t j = 0; j < n; ++j) depth_bits[place[j]] = std::min(depth_bits[place[j]], bits[j]);
                 });
    }
  }
}

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
