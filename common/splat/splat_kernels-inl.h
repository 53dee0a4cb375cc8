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

constexpr size_t kBatch =
    512;  // projected points held before they are splatted: their arrays stay in the first-level cache
constexpr size_t kMaxLanes = 64;  // float lanes of the widest vectors there are
constexpr size_t kPiece =
    384;  // points of an item taken at once: room for a whole piece is made before it is projected

// Positions of a vector of points, in steps of the leaf's grid.
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
  return {FloorToInt(hn::Add(hn::Mul(Row(t.x, p), inverse), s)), FloorToInt(hn::Add(hn::Mul(Row(t.y, p), inverse), s)),
          w};
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

// Lane numbers that are set in a mask of 8 bits, in order; 0 beyond.
struct CompressTable {
  uint8_t lane[256][8];
};
constexpr CompressTable make_compress_table() {
  CompressTable t{};
  for (int bits = 0; bits < 256; ++bits)
    for (int i = 0, n = 0; i < 8; ++i)
      if (bits >> i & 1) t.lane[bits][n++] = static_cast<uint8_t>(i);
  return t;
}
alignas(64) constexpr CompressTable kCompress = make_compress_table();

// Moves the lanes of a mask to the front, the same for several vectors. (Highway's own Compress in 1.0 copies its 1 KiB table to the
// stack at each call when GCC compiles it: bench splat_square was 1.7 times slower with it.)
class Compressor {
 public:
  explicit HWY_INLINE Compressor(hn::Mask<U32> mask) : mask_(mask) {
    if (hn::Lanes(U32()) > 8) return;
    uint8_t bits[hwy::HWY_NAMESPACE::MaxLanes(U32()) / 8 + 8] = {};
    hn::StoreMaskBits(U32(), mask, bits);
    bits_ = bits[0];
  }
  HWY_INLINE size_t count() const { return hn::CountTrue(U32(), mask_); }
  HWY_INLINE hn::Vec<U32> operator()(hn::Vec<U32> v) const {
    const U32 d;
    if (hn::Lanes(d) > 8) return hn::Compress(v, mask_);
    const hn::Rebind<uint8_t, U32> d8;
    const auto lanes = hn::PromoteTo(d, hn::LoadU(d8, kCompress.lane[bits_]));
    return hn::TableLookupLanes(v, hn::IndicesFromVec(d, lanes));
  }

 private:
  hn::Mask<U32> mask_;
  uint32_t bits_ = 0;
};

// Collects the points of levels that have fewer of them than a vector has lanes: after many small updates most mosaics do.
class Stage {
 public:
  bool has_room(size_t n) const { return count_ + n <= kCapacity; }
  void clear() { count_ = 0; }
  HWY_INLINE void append(const points::Mosaic::Level& l) {
    const size_t n = l.count;
    copy(l.x, x_ + count_, n), copy(l.y, y_ + count_, n), copy(l.z, z_ + count_, n),
        copy(l.normal, normal_ + count_, n);
    copy(l.colour, colour_ + count_, n);
    count_ += n;
  }
  /// Whole vectors can be read wherever a point is.
  points::Mosaic::Level level() const { return {static_cast<uint32_t>(count_), x_, y_, z_, normal_, colour_}; }

 private:
  static constexpr size_t kCapacity = 128;

  // Few elements go by two moves of fixed size that overlap, instead of a loop.
  template <class T>
  static HWY_INLINE void copy(const T* HWY_RESTRICT from, T* HWY_RESTRICT to, size_t n) {
    if (n >= 8)
      std::memcpy(to, from, n * sizeof(T));
    else if (n >= 4)
      move_ends<4>(from, to, n);
    else if (n >= 2)
      move_ends<2>(from, to, n);
    else if (n == 1)
      *to = *from;
  }
  template <size_t kElements, class T>
  static HWY_INLINE void move_ends(const T* HWY_RESTRICT from, T* HWY_RESTRICT to, size_t n) {
    std::memcpy(to, from, kElements * sizeof(T));
    std::memcpy(to + n - kElements, from + n - kElements, kElements * sizeof(T));
  }

  uint16_t x_[kCapacity + kMaxLanes] = {}, y_[kCapacity + kMaxLanes] = {}, z_[kCapacity + kMaxLanes] = {};
  uint16_t normal_[kCapacity + kMaxLanes] = {};
  uint32_t colour_[kCapacity + kMaxLanes] = {};
  size_t count_ = 0;
};

// Calls visit(offset, skip, valid) for vectors that cover the points [first, last) of a level: lanes skip..valid-1 are points not
// visited yet. The last vector overlaps the one before, so that nothing is read beyond the arrays of a level that has at least a
// vector of points; a Stage may have fewer.
template <class Visit>
HWY_INLINE void ForVectors(size_t first, size_t last, const Visit& visit) {
  const size_t lanes = hn::Lanes(F32());
  size_t i = first;
  for (; i + lanes <= last; i += lanes) visit(i, size_t{0}, lanes);
  if (i == last) return;
  if (last >= lanes)
    visit(last - lanes, i - (last - lanes), lanes);
  else
    visit(i, size_t{0}, last - i);
}

// Mosaics lie scattered in memory, and what comes next is known: asks for it in time. A level's arrays lie next to each other,
// except for mean colours, so asking for lines from x on finds nearly all.
constexpr uint32_t kItemsAhead = 8;
HWY_INLINE void PrefetchLevel(const points::Mosaic::Level& level) {
  const auto* p = reinterpret_cast<const std::byte*>(level.x);
  const size_t bytes = std::min<size_t>(size_t{12} * level.count, 2048);
  for (size_t i = 0; i < bytes; i += 64) hwy::Prefetch(p + i);
}
HWY_INLINE void PrefetchRun(const TileInput& input, const TileBinning::Entry* entry) {
  const TileBinning::Entry* end = input.entries.data() + input.entries.size();
  if (entry == end) return;
  const ItemRun run = input.runs[entry->box];
  // The run after it: its items, so that its points can be asked for without waiting.
  if (entry + 1 != end) {
    const auto* items = reinterpret_cast<const std::byte*>(input.items + input.runs[entry[1].box].first);
    for (size_t i = 0; i < kItemsAhead * sizeof(DrawItem); i += 64) hwy::Prefetch(items + i);
  }
  for (uint32_t i = run.first; i < std::min(run.first + kItemsAhead, run.last); ++i)
    PrefetchLevel(input.items[i].level);
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
HWY_INLINE void SplatOne(uint64_t* HWY_RESTRICT pixels, size_t stride, const uint64_t* HWY_RESTRICT addends,
                         int64_t key) {
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
    SplatBatch<1>,  SplatBatch<2>,  SplatBatch<3>,  SplatBatch<4>,  SplatBatch<5>,  SplatBatch<6>,
    SplatBatch<7>,  SplatBatch<8>,  SplatBatch<9>,  SplatBatch<10>, SplatBatch<11>, SplatBatch<12>,
    SplatBatch<13>, SplatBatch<14>, SplatBatch<15>, SplatBatch<16>};

class TileSplatter {
 public:
  TileSplatter(const TileInput& input, const uint8_t* intensity, const KeyBuffer& buffer)
      : input_(input), intensity_(intensity), buffer_(buffer) {}

  TileCounts run(const SplatShape* const* shapes) {
    const size_t lanes = hn::Lanes(F32());
    for (const TileBinning::Entry& entry : input_.entries) {
      const ItemRun run = input_.runs[entry.box];
      const LeafTransform& transform = input_.transforms[entry.box];
      PrefetchRun(input_, &entry + 1);
      for (uint32_t i = run.first; i < run.last; ++i) {
        if (i + kItemsAhead < run.last) PrefetchLevel(input_.items[i + kItemsAhead].level);
        if (shapes[i] != shape_) {
          drain(transform, entry.whole);
          flush();
          shape_ = shapes[i];
        }
        const points::Mosaic::Level& level = input_.items[i].level;
        if (level.count >= lanes) {
          add(transform, level, entry.whole);
        } else {
          if (!stage_.has_room(level.count)) drain(transform, entry.whole);
          stage_.append(level);
        }
      }
      drain(transform, entry.whole);
    }
    flush();
    return counts_;
  }

 private:
  void flush() {
    if (batch_.count > 0) kSplatBatch[shape_->side - 1](*shape_, buffer_, batch_);
    batch_.count = 0;
  }

  // Stage -> batch. What is staged belongs to one cluster and has one shape.
  void drain(const LeafTransform& transform, bool whole) {
    const points::Mosaic::Level level = stage_.level();
    if (level.count > 0) add(transform, level, whole);
    stage_.clear();
  }

  void add(const LeafTransform& transform, const points::Mosaic::Level& level, bool whole) {
    counts_.projected += level.count;
    for (size_t first = 0; first < level.count; first += kPiece) {
      const size_t last = std::min<size_t>(first + kPiece, level.count);
      if (batch_.count + (last - first) > kBatch) flush();
      if (whole)
        add_piece<true>(transform, level, first, last);
      else
        add_piece<false>(transform, level, first, last);
    }
  }

  template <bool kWhole>
  HWY_NOINLINE void add_piece(const LeafTransform& transform_reference, const points::Mosaic::Level& level_reference,
                              size_t first, size_t last) {
    const I32 di;
    const U32 du;
    // Copies, which no store can change: the compiler need not read them again.
    const LeafTransform transform = transform_reference;
    const points::Mosaic::Level level = level_reference;
    const uint8_t* const intensity = intensity_;
    uint32_t* const places = batch_.place;
    uint64_t* const keys = batch_.key;
    const int bits = shape_->sub_bits;
    const float near_m = input_.near_m, scale = shape_->scale, shift = shape_->shift;
    const auto x0 = hn::Set(di, input_.rect.x), y0 = hn::Set(di, input_.rect.y);
    const auto width = hn::Set(di, input_.rect.width), height = hn::Set(di, input_.rect.height);
    const auto outside = hn::Set(di, -shape_->side), minus_one = hn::Set(di, -1);
    const auto stride = hn::Set(di, buffer_.stride), origin = hn::Set(di, buffer_.margin * (buffer_.stride + 1));
    const auto sub_mask = hn::Set(di, (1 << bits) - 1);
    size_t count = batch_.count, drawn = 0;

    ForVectors(first, last, [&](size_t offset, size_t skip, size_t valid) HWY_ATTR {
      const Projected p = Project(transform, LoadLanes(level, offset), near_m, scale, shift);
      const auto px = hn::Sub(hn::ShiftRightSame(p.x, bits), x0), py = hn::Sub(hn::ShiftRightSame(p.y, bits), y0);
      hn::Mask<I32> keep;
      if (!kWhole) {
        const auto in_x = hn::And(hn::Gt(px, outside), hn::Lt(px, width)),
                   in_y = hn::And(hn::Gt(py, outside), hn::Lt(py, height));
        const auto beyond_near = hn::RebindMask(di, hn::Ge(p.w, hn::Set(F32(), near_m)));
        keep = hn::And(hn::And(in_x, in_y), beyond_near);
        if (valid - skip < hn::Lanes(di)) keep = hn::And(keep, hn::AndNot(hn::FirstN(di, skip), hn::FirstN(di, valid)));
        if (hn::AllFalse(di, keep)) return;
        drawn += hn::CountTrue(di, hn::And(keep, hn::And(hn::Gt(px, minus_one), hn::Gt(py, minus_one))));
      }

      const auto pixel = hn::Add(hn::Add(hn::Mul(py, stride), px), origin);
      const auto sub = hn::Or(hn::ShiftLeftSame(hn::And(p.y, sub_mask), bits), hn::And(p.x, sub_mask));
      const auto place = hn::BitCast(du, hn::Or(hn::ShiftLeftSame(pixel, 2 * bits), sub));

      const auto normal = hn::BitCast(di, hn::PromoteTo(du, hn::LoadU(U16(), level.normal + offset)));
      const auto light = hn::GatherOffset(di, reinterpret_cast<const int32_t*>(intensity), normal);
      const auto colour =
          Shade(hn::LoadU(du, level.colour + offset), hn::And(hn::BitCast(du, light), hn::Set(du, 255)));
      const auto depth = hn::Or(hn::BitCast(du, p.w), hn::Set(du, 0x80000000u));

      if (kWhole) {
        // Lanes below `skip` are the batch's last points: they are written once more, as they are. (None are there if the batch
        // was emptied in between; then they are splatted twice, which changes nothing.)
        const size_t at = count >= skip ? count - skip : 0;
        hn::StoreU(place, du, places + at);
        hn::StoreInterleaved2(colour, depth, du, reinterpret_cast<uint32_t*>(keys + at));
        count = at + valid;
      } else {
        const Compressor compress(hn::RebindMask(du, keep));
        hn::StoreU(compress(place), du, places + count);
        hn::StoreInterleaved2(compress(colour), compress(depth), du, reinterpret_cast<uint32_t*>(keys + count));
        count += compress.count();
      }
    });
    batch_.count = count;
    counts_.drawn += kWhole ? last - first : drawn;
  }

  const TileInput& input_;
  const uint8_t* intensity_;
  const KeyBuffer& buffer_;
  const SplatShape* shape_ = nullptr;
  TileCounts counts_;
  Stage stage_;
  Batch batch_;
};

TileCounts SplatTile(const TileInput& input, const SplatShape* const* shapes, const uint8_t* intensity,
                     const KeyBuffer& buffer) {
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

void ResolveTile(const KeyBuffer& buffer, int width, int height, uint32_t background, uint32_t* colour, float* depth_m,
                 size_t pitch) {
  const U32 d;
  const F32 df;
  const size_t lanes = hn::Lanes(d);
  const auto opaque = hn::Set(d, 0xff000000u), empty_half = hn::Set(d, 0xffffffffu), paper = hn::Set(d, background);
  const auto magnitude = hn::Set(d, 0x7fffffffu), infinity = hn::Set(d, 0x7f800000u);
  for (int y = 0; y < height; ++y) {
    uint64_t* keys = buffer.keys + static_cast<size_t>(y + buffer.margin) * buffer.stride + buffer.margin;
    uint32_t* out = colour + y * pitch;
    float* out_depth = depth_m ? depth_m + y * pitch : nullptr;
    const auto n = static_cast<size_t>(width);
    size_t x = 0;
    for (; x + lanes <= n; x += lanes) {
      hn::Vec<U32> low, high;
      auto* key = reinterpret_cast<uint32_t*>(keys + x);
      hn::LoadInterleaved2(d, key, low, high);
      hn::StoreU(empty_half, d, key);
      hn::StoreU(empty_half, d, key + lanes);
      const auto empty = hn::Eq(high, empty_half);
      // Ordinary stores: past the caches they took three times as long here (bench splat_square, resolve_ms).
      hn::StoreU(hn::Or(hn::IfThenElse(empty, paper, low), opaque), d, out + x);
      if (out_depth) {
        const auto bits = hn::Sub(hn::And(high, magnitude), hn::ShiftLeft<kBiasShift>(hn::ShiftRight<24>(low)));
        hn::StoreU(hn::BitCast(df, hn::IfThenElse(empty, infinity, bits)), df, out_depth + x);
      }
    }
    for (; x < n; ++x) ResolvePixel(keys[x], background, out + x, out_depth ? out_depth + x : nullptr);
  }
}

template <bool kWhole>
HWY_NOINLINE void DepthLevel(const LeafTransform& transform_reference, const points::Mosaic::Level& level_reference,
                             const geometry::Rect& rect, float near_m, uint32_t* depth_bits) {
  const I32 di;
  const U32 du;
  const LeafTransform transform = transform_reference;
  const points::Mosaic::Level level = level_reference;
  const auto x0 = hn::Set(di, rect.x), y0 = hn::Set(di, rect.y);
  const auto width = hn::Set(di, rect.width), height = hn::Set(di, rect.height), minus_one = hn::Set(di, -1);
  HWY_ALIGN uint32_t place[kMaxLanes];
  HWY_ALIGN uint32_t bits[kMaxLanes];
  // A point met twice changes nothing, so lanes that overlap are not left out.
  ForVectors(0, level.count, [&](size_t offset, size_t, size_t valid) HWY_ATTR {
    const Projected p = Project(transform, LoadLanes(level, offset), near_m, 1.0f, 0.0f);
    const auto px = hn::Sub(p.x, x0), py = hn::Sub(p.y, y0);
    const auto at = hn::BitCast(du, hn::Add(hn::Mul(py, width), px)), depth = hn::BitCast(du, p.w);
    size_t n = valid;
    if (kWhole) {
      hn::Store(at, du, place);
      hn::Store(depth, du, bits);
    } else {
      const auto in_x = hn::And(hn::Gt(px, minus_one), hn::Lt(px, width));
      const auto in_y = hn::And(hn::Gt(py, minus_one), hn::Lt(py, height));
      const auto beyond_near = hn::RebindMask(di, hn::Ge(p.w, hn::Set(F32(), near_m)));
      const auto keep = hn::And(hn::FirstN(di, valid), hn::And(hn::And(in_x, in_y), beyond_near));
      if (hn::AllFalse(di, keep)) return;
      const Compressor compress(hn::RebindMask(du, keep));
      hn::Store(compress(at), du, place);
      hn::Store(compress(depth), du, bits);
      n = compress.count();
    }
    for (size_t j = 0; j < n; ++j) depth_bits[place[j]] = std::min(depth_bits[place[j]], bits[j]);
  });
}

void DepthTile(const TileInput& input, uint32_t* depth_bits) {
  const size_t lanes = hn::Lanes(F32());
  Stage stage;
  for (const TileBinning::Entry& entry : input.entries) {
    const auto draw = [&](const points::Mosaic::Level& level) {
      (entry.whole ? DepthLevel<true> : DepthLevel<false>)(input.transforms[entry.box], level, input.rect, input.near_m,
                                                           depth_bits);
    };
    const auto drain = [&] {
      draw(stage.level());
      stage.clear();
    };
    const ItemRun run = input.runs[entry.box];
    PrefetchRun(input, &entry + 1);
    for (uint32_t i = run.first; i < run.last; ++i) {
      if (i + kItemsAhead < run.last) PrefetchLevel(input.items[i + kItemsAhead].level);
      const points::Mosaic::Level& level = input.items[i].level;
      if (level.count >= lanes) {
        draw(level);
      } else {
        if (!stage.has_room(level.count)) drain();
        stage.append(level);
      }
    }
    drain();
  }
}

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
