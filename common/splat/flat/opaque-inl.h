// Opaque splats whose shapes come from a table: square and disc.
// Included once a target, by splat_kernels.cpp.
#if defined(TELESPLAT_SPLAT_OPAQUE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SPLAT_OPAQUE_INL_H_
#undef TELESPLAT_SPLAT_OPAQUE_INL_H_
#else
#define TELESPLAT_SPLAT_OPAQUE_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "common/splat/projection-inl.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {

// Projected points held before they are splatted: few enough for the first-level cache.
constexpr size_t kBatch = 512;
constexpr size_t kApart = 8;

// Projected points, waiting to be splatted.
struct Batch {
  // index of the first pixel << 2 sub_bits | sub_y << sub_bits | sub_x
  HWY_ALIGN uint32_t place[kBatch + kMaxLanes];
  HWY_ALIGN uint64_t key[kBatch + kMaxLanes];
  size_t count = 0;
};

// Draws the rows of a splat, in whole vectors: pixels beyond the splat's side are written back unchanged.
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
  // Neighbours in the batch often overlap on the screen. Reading a row right after it was written across its ends waits
  // for that write to leave the store buffer. So points far apart in the batch follow one another: the least key wins
  // in any order.
  const size_t step = (batch.count + kApart - 1) / kApart;
  for (size_t j = 0; j < step; ++j)
    for (size_t i = j; i < batch.count; i += step) {
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

// Selects the points of a tile's rect that are drawn, and those that are counted, by the first pixel of their splat
// (from the rect's first pixel). As vectors.
class TileArea {
 public:
  HWY_INLINE TileArea(const TileInput& input, int side) {
    const I32 di;
    const geometry::Rect &rect = input.rect, &own = input.own;
    width_ = hn::Set(di, rect.width), height_ = hn::Set(di, rect.height), outside_ = hn::Set(di, -side);
    own_x0_ = hn::Set(di, own.x - rect.x - 1), own_y0_ = hn::Set(di, own.y - rect.y - 1);
    own_x1_ = hn::Set(di, own.x + own.width - rect.x), own_y1_ = hn::Set(di, own.y + own.height - rect.y);
  }
  HWY_INLINE hn::Mask<I32> touched(hn::Vec<I32> x, hn::Vec<I32> y) const {
    return hn::And(hn::And(hn::Gt(x, outside_), hn::Lt(x, width_)), hn::And(hn::Gt(y, outside_), hn::Lt(y, height_)));
  }
  HWY_INLINE hn::Mask<I32> own(hn::Vec<I32> x, hn::Vec<I32> y) const {
    return hn::And(hn::And(hn::Gt(x, own_x0_), hn::Lt(x, own_x1_)), hn::And(hn::Gt(y, own_y0_), hn::Lt(y, own_y1_)));
  }

 private:
  hn::Vec<I32> width_, height_, outside_, own_x0_, own_y0_, own_x1_, own_y1_;
};

// The two halves of keys.
struct KeyHalves {
  hn::Vec<U32> low, high;
};
// head: the high half of the bits that all points share.
HWY_INLINE KeyHalves KeysOf(hn::Vec<F32> w, hn::Vec<U32> normal, hn::Vec<U32> colour, hn::Vec<U32> near_bits,
                            hn::Vec<U32> head) {
  const U32 du;
  const auto code =
      hn::Min(hn::ShiftRight<kDepthCodeShift>(hn::Sub(hn::BitCast(du, w), near_bits)), hn::Set(du, kMaxCentreCode));
  return {hn::Or(hn::ShiftLeft<24>(normal), hn::And(colour, hn::Set(du, 0x00ffffffu))),
          hn::Or(hn::Or(hn::ShiftLeft<kKeyDepthBit - 32>(code), hn::ShiftRight<8>(normal)), head)};
}

// Clears lanes outside [skip, valid): see ForVectors.
HWY_INLINE hn::Mask<I32> OnlyNew(hn::Mask<I32> keep, size_t skip, size_t valid) {
  const I32 di;
  if (valid - skip == hn::Lanes(di)) return keep;
  return hn::And(keep, hn::AndNot(hn::FirstN(di, skip), hn::FirstN(di, valid)));
}

// Stores the lanes of `keep` side by side. Returns their number; whole vectors are written.
HWY_INLINE size_t StoreKept(hn::Mask<I32> keep, hn::Vec<U32> place, const KeyHalves& key, uint32_t* places,
                            uint64_t* keys) {
  const U32 du;
  auto* const halves = reinterpret_cast<uint32_t*>(keys);
  // Mosaics are scanned in order: most vectors of a cluster across a tile's border lie on one side of it.
  if (hn::AllTrue(I32(), keep)) {
    hn::StoreU(place, du, places);
    hn::StoreInterleaved2(key.low, key.high, du, halves);
    return hn::Lanes(du);
  }
  const Compressor compress(hn::RebindMask(du, keep));
  hn::StoreU(compress(place), du, places);
  hn::StoreInterleaved2(compress(key.low), compress(key.high), du, halves);
  return compress.count();
}

using SplatBatchFunction = void (*)(const SplatShape&, const KeyBuffer&, const Batch&);
constexpr SplatBatchFunction kSplatBatch[kMaxSplatSide] = {
    SplatBatch<1>,  SplatBatch<2>,  SplatBatch<3>,  SplatBatch<4>,  SplatBatch<5>,  SplatBatch<6>,
    SplatBatch<7>,  SplatBatch<8>,  SplatBatch<9>,  SplatBatch<10>, SplatBatch<11>, SplatBatch<12>,
    SplatBatch<13>, SplatBatch<14>, SplatBatch<15>, SplatBatch<16>};

class TileSplatter {
 public:
  TileSplatter(const TileInput& input, const KeyBuffer& buffer) : input_(input), buffer_(buffer) {}

  TileCounts run(const ItemStyle* styles) {
    const size_t lanes = hn::Lanes(F32());
    for (const TileBinning::Entry& entry : input_.entries) {
      const ItemRun run = input_.runs[entry.box];
      PrefetchRun(input_, &entry + 1);
      for (uint32_t i = run.first; i < run.last; ++i) {
        if (i + kItemsAhead < run.last) PrefetchLevel(input_.items[i + kItemsAhead].level);
        if (styles[i] != style_) {
          drain(entry);
          if (styles[i].shape != style_.shape) flush();
          style_ = styles[i];
        }
        const DrawItem& item = input_.items[i];
        if (item.level.count >= lanes) {
          add(entry, item.level, item.may_face_away);
        } else {
          if (!stage_.has_room(item.level.count)) drain(entry);
          stage_.append(item);
        }
      }
      drain(entry);
    }
    flush();
    return counts_;
  }

 private:
  void flush() {
    if (batch_.count > 0) kSplatBatch[style_.shape->side - 1](*style_.shape, buffer_, batch_);
    batch_.count = 0;
  }

  // Moves the staged points to the batch. They belong to one cluster and have one shape.
  void drain(const TileBinning::Entry& entry) {
    const points::Mosaic::Level level = stage_.level();
    if (level.count > 0) add(entry, level, stage_.may_face_away());
    stage_.clear();
  }

  void add(const TileBinning::Entry& entry, const points::Mosaic::Level& level, bool may_face_away) {
    const LeafTransform& transform = input_.transforms[entry.box];
    const glm::vec3& facing = input_.facing[entry.box];
    const auto piece =
        entry.whole ? (may_face_away ? &TileSplatter::add_piece<true, true> : &TileSplatter::add_piece<true, false>)
                    : (may_face_away ? &TileSplatter::add_piece<false, true> : &TileSplatter::add_piece<false, false>);
    counts_.projected += level.count;
    for (size_t first = 0; first < level.count; first += kPiece) {
      const size_t last = std::min<size_t>(first + kPiece, level.count);
      if (batch_.count + (last - first) > kBatch) flush();
      (this->*piece)(transform, facing, level, first, last);
    }
  }

  template <bool kWhole, bool kMayFaceAway>
  HWY_NOINLINE void add_piece(const LeafTransform& transform_reference, const glm::vec3& facing_reference,
                              const points::Mosaic::Level& level_reference, size_t first, size_t last) {
    const I32 di;
    const U32 du;
    // Local copies, which no store can change: the compiler need not read them again.
    const LeafTransform transform = transform_reference;
    const points::Mosaic::Level level = level_reference;
    const glm::vec3 facing = facing_reference;
    uint32_t* const places = batch_.place;
    uint64_t* const keys = batch_.key;
    const int bits = style_.shape->sub_bits;
    const float near_m = input_.near_m, scale = style_.shape->scale, shift = style_.shape->shift;
    const auto x0 = hn::Set(di, input_.rect.x), y0 = hn::Set(di, input_.rect.y);
    const TileArea area(input_, style_.shape->side);
    const auto near_bits = hn::Set(du, std::bit_cast<uint32_t>(near_m));
    const auto head = hn::Set(du, static_cast<uint32_t>(encode_key(0, style_.spacing, 0, 0, 0) >> 32));
    const auto stride = hn::Set(di, buffer_.stride), origin = hn::Set(di, buffer_.margin * (buffer_.stride + 1));
    const auto sub_mask = hn::Set(di, (1 << bits) - 1);
    size_t count = batch_.count, drawn = 0;

    ForVectors(
        first, last, [&](size_t offset, size_t skip, size_t valid) HWY_ATTR __attribute__((always_inline)) {
          const Projected p = Project(transform, LoadLanes(level, offset), near_m, scale, shift);
          const auto px = hn::Sub(hn::ShiftRightSame(p.x, bits), x0), py = hn::Sub(hn::ShiftRightSame(p.y, bits), y0);
          const auto normal = hn::PromoteTo(du, hn::LoadU(U16(), level.normal + offset));
          hn::Mask<I32> keep;
          if (kWhole && kMayFaceAway) {
            keep = hn::Not(hn::RebindMask(di, FacesAway(normal, facing)));
            keep = OnlyNew(keep, skip, valid);
            if (hn::AllFalse(di, keep)) return;
            drawn += hn::CountTrue(di, keep);
          }
          if (!kWhole) {
            keep = hn::And(area.touched(px, py), hn::RebindMask(di, hn::Ge(p.w, hn::Set(F32(), near_m))));
            if (kMayFaceAway) keep = hn::AndNot(hn::RebindMask(di, FacesAway(normal, facing)), keep);
            keep = OnlyNew(keep, skip, valid);
            if (hn::AllFalse(di, keep)) return;
            drawn += hn::CountTrue(di, hn::And(keep, area.own(px, py)));
          }

          const auto pixel = hn::Add(hn::Add(hn::Mul(py, stride), px), origin);
          const auto sub = hn::Or(hn::ShiftLeftSame(hn::And(p.y, sub_mask), bits), hn::And(p.x, sub_mask));
          const auto place = hn::BitCast(du, hn::Or(hn::ShiftLeftSame(pixel, 2 * bits), sub));
          const auto [low, high] = KeysOf(p.w, normal, hn::LoadU(du, level.colour + offset), near_bits, head);

          if (kWhole && !kMayFaceAway) {
            // Lanes below `skip` are the batch's last points: they are written once more, unchanged. (If the batch was
            // emptied in between, they are splatted twice, which changes nothing.)
            const size_t at = count >= skip ? count - skip : 0;
            hn::StoreU(place, du, places + at);
            hn::StoreInterleaved2(low, high, du, reinterpret_cast<uint32_t*>(keys + at));
            count = at + valid;
          } else {
            count += StoreKept(keep, place, {low, high}, places + count, keys + count);
          }
        });
    batch_.count = count;
    counts_.drawn += kWhole && !kMayFaceAway ? last - first : drawn;
  }

  const TileInput& input_;
  const KeyBuffer& buffer_;
  ItemStyle style_;
  TileCounts counts_;
  Stage stage_;
  Batch batch_;
};

TileCounts SplatTile(const TileInput& input, const ItemStyle* styles, const KeyBuffer& buffer) {
  return TileSplatter(input, buffer).run(styles);
}

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
