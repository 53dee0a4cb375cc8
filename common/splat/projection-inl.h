// Vectors of points: loads and projects them, moves kept lanes to the front, and speeds up many short levels.
// Included once a target, by splat_kernels.cpp and surfel/kernels.cpp.
#if defined(TELESPLAT_SPLAT_PROJECTION_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SPLAT_PROJECTION_INL_H_
#undef TELESPLAT_SPLAT_PROJECTION_INL_H_
#else
#define TELESPLAT_SPLAT_PROJECTION_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>

#include "common/splat/splat_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F32 = hn::ScalableTag<float>;
using I32 = hn::RebindToSigned<F32>;
using U32 = hn::RebindToUnsigned<F32>;
using U16 = hn::Rebind<uint16_t, F32>;

constexpr size_t kMaxLanes = 64;  // float lanes of the widest vectors
// Points of an item processed at once: room for a whole piece is made before it is projected.
constexpr size_t kPiece = 384;

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

// floor(v), as integers. Values that do not fit lie far outside every image; they only need to stay outside.
HWY_INLINE hn::Vec<I32> FloorToInt(hn::Vec<F32> v) {
  const F32 d;
  const auto limit = hn::Set(d, 1e6f);
  // A whole number below 2^22 plus 1.5 * 2^23 has the number in the float's last bits. Faster than ConvertTo, which
  // also guards against values that cannot occur here.
  constexpr float kWhole = 12582912.0f;
  const auto floor = hn::Floor(hn::Max(hn::Min(v, limit), hn::Neg(limit)));
  return hn::Sub(hn::BitCast(I32(), hn::Add(floor, hn::Set(d, kWhole))),
                 hn::Set(I32(), std::bit_cast<int32_t>(kWhole)));
}

// Lanes whose points face away (facing.h).
HWY_INLINE hn::Mask<F32> FacesAway(hn::Vec<U32> normal, const glm::vec3& facing) {
  const F32 d;
  const I32 di;
  const auto at = [&](hn::Vec<U32> c) HWY_ATTR {
    return hn::Min(hn::Sub(hn::ConvertTo(d, hn::BitCast(di, c)), hn::Set(d, 127.0f)), hn::Set(d, 127.0f));
  };
  auto x = at(hn::And(normal, hn::Set(U32(), 255u)));
  auto y = at(hn::ShiftRight<8>(normal));
  const auto z = hn::Sub(hn::Sub(hn::Set(d, 127.0f), hn::Abs(x)), hn::Abs(y));
  const auto fold = hn::Max(hn::Neg(z), hn::Zero(d));
  x = hn::Sub(x, hn::CopySign(fold, x));
  y = hn::Sub(y, hn::CopySign(fold, y));
  const auto towards = hn::Add(hn::Add(hn::Mul(x, hn::Set(d, facing.x)), hn::Mul(y, hn::Set(d, facing.y))),
                               hn::Mul(z, hn::Set(d, facing.z)));
  const auto length2 = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
  return hn::And(hn::Lt(towards, hn::Zero(d)), hn::Gt(hn::Mul(towards, towards), length2));
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

// Numbers of the lanes that are set in a mask of 8 bits, in order; 0 beyond.
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

// Moves the lanes of a mask to the front, the same for several vectors. (Highway 1.0's own Compress copies its 1 KiB
// table to the stack at each call when GCC compiles it: bench splat_square was 1.7 times slower with it.)
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

// Collects the points of levels with fewer points than a vector has lanes, as most mosaics have after many small
// updates.
class Stage {
 public:
  bool has_room(size_t n) const { return count_ + n <= kCapacity; }
  void clear() {
    count_ = 0;
    may_face_away_ = false;
  }
  /// True if points of any staged item may face away: then all points are tested.
  bool may_face_away() const { return may_face_away_; }
  HWY_INLINE void append(const DrawItem& item) {
    const points::Mosaic::Level& l = item.level;
    may_face_away_ |= item.may_face_away;
    const size_t n = l.count;
    copy(l.x, x_ + count_, n), copy(l.y, y_ + count_, n), copy(l.z, z_ + count_, n),
        copy(l.normal, normal_ + count_, n);
    copy(l.colour, colour_ + count_, n);
    count_ += n;
  }
  /// The staged points; whole vectors can be read from any point on.
  points::Mosaic::Level level() const { return {static_cast<uint32_t>(count_), x_, y_, z_, normal_, colour_}; }

 private:
  static constexpr size_t kCapacity = 128;

  // Copies few elements by two overlapping moves of fixed size, instead of a loop.
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
  bool may_face_away_ = false;
};

// Calls visit(offset, skip, valid) for vectors that cover the points [first, last) of a level: lanes skip..valid-1 are
// points not visited yet. The last vector overlaps the one before, so that nothing is read beyond the arrays of levels
// with at least a vector; a Stage may have fewer points.
template <class Visit>
HWY_INLINE void ForVectors(size_t first, size_t last, const Visit& visit) {
  const size_t lanes = hn::Lanes(F32());
  // A single call site, so that it is inlined into the loop.
  for (size_t i = first; i < last; i += lanes) {
    const size_t offset = i + lanes <= last || last < lanes ? i : last - lanes;
    visit(offset, i - offset, std::min(lanes, last - offset));
  }
}

// Prefetches the next mosaics, which lie scattered in memory. A level's arrays lie next to each other, except for mean
// colours: prefetching lines from x on finds nearly all of them.
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
  // Prefetches the items of the run after it, so that its points can be prefetched without waiting.
  if (entry + 1 != end) {
    const auto* items = reinterpret_cast<const std::byte*>(input.items + input.runs[entry[1].box].first);
    for (size_t i = 0; i < kItemsAhead * sizeof(DrawItem); i += 64) hwy::Prefetch(items + i);
  }
  for (uint32_t i = run.first; i < std::min(run.first + kItemsAhead, run.last); ++i)
    PrefetchLevel(input.items[i].level);
}

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
