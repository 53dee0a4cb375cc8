// Batches of splats that wait for one of the two passes of the kernel `ewa`, and the pixels of a splat.
// Included once a target, by surfel/kernels.cpp.
#if defined(TELESPLAT_SPLAT_EWA_BLOCKS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SPLAT_EWA_BLOCKS_INL_H_
#undef TELESPLAT_SPLAT_EWA_BLOCKS_INL_H_
#else
#define TELESPLAT_SPLAT_EWA_BLOCKS_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstring>
#include <type_traits>

#include "common/splat/surfel/surfel-inl.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {

// Splats waiting to be drawn: arrays of one field each.
template <size_t kFields>
struct SplatBatch {
  static constexpr size_t kCapacity = 128;
  HWY_ALIGN uint32_t fields[kFields][kCapacity];
  size_t count;

  bool full() const { return count + hn::Lanes(U32()) > kCapacity; }
  uint32_t at(size_t field, size_t i) const { return fields[field][i]; }
  float real(size_t field, size_t i) const {
    float v;
    std::memcpy(&v, &fields[field][i], sizeof v);
    return v;
  }
};

// Fields that both passes use, then those of the second.
enum EwaField {
  kPlaceE,
  kSizeE,
  kFirstXE,
  kFirstYE,
  kCentreXE,
  kCentreYE,
  kXXE,
  kXYE,
  kYYE,
  kCodeE,
  kCodeXE,
  kCodeYE,
  kEwaFields,
  kEpsilonE = kEwaFields,
  kPeakE,
  kAlbedoE,
  kNormalXE,
  kNormalYE,
  kNormalZE,
  kSumFields
};
using EwaBatch = SplatBatch<kEwaFields>;
using SumBatch = SplatBatch<kSumFields>;

constexpr uint32_t kCutBit = 1 << 16;  // bit of kSizeE: the box ends before the ellipse does

template <size_t kFields>
HWY_INLINE void PutConics(SplatBatch<kFields>& batch, const Compressor& compress, const Conics& c, const Depths& depth,
                          const geometry::Rect& rect, int stride) {
  const F32 d;
  const I32 di;
  const U32 du;
  const auto put = [&](size_t field, VU v) HWY_ATTR { hn::StoreU(compress(v), du, batch.fields[field] + batch.count); };
  const auto put_float = [&](size_t field, VF v) HWY_ATTR { put(field, hn::BitCast(du, v)); };
  const auto row = hn::Sub(c.y0, hn::Set(di, rect.y)), column = hn::Sub(c.x0, hn::Set(di, rect.x));
  put(kPlaceE, hn::BitCast(du, hn::Add(hn::Mul(row, hn::Set(di, stride)), column)));
  put(kSizeE, hn::BitCast(du, hn::Or(hn::Or(hn::Sub(c.x1, c.x0), hn::ShiftLeft<8>(hn::Sub(c.y1, c.y0))),
                                     hn::IfThenElseZero(c.cut, hn::Set(di, static_cast<int>(kCutBit))))));
  put_float(kFirstXE, hn::Add(hn::ConvertTo(d, c.x0), Const(0.5f)));
  put_float(kFirstYE, hn::Add(hn::ConvertTo(d, c.y0), Const(0.5f)));
  put_float(kCentreXE, c.centre_x), put_float(kCentreYE, c.centre_y);
  put_float(kXXE, c.xx), put_float(kXYE, c.xy), put_float(kYYE, c.yy);
  put_float(kCodeE, depth.centre), put_float(kCodeXE, depth.x), put_float(kCodeYE, depth.y);
}

// Calls pixels(first pixel's index, mask of the row's pixels in the ellipse, q, depth code) for kRows rows of kColumns
// pixels of splat i: the block that begins (x, y) pixels into its box. Without kCut the block is not cut to the box:
// pixels beyond the box lie outside the ellipse, or beyond the tile where they are never read. Rows come as vectors of
// up to 8 pixels.
template <bool kCut, int kColumns, int kRows, size_t kFields, class PixelsOfRow>
HWY_INLINE void ForRows(const SplatBatch<kFields>& batch, size_t i, int stride, int x, int y,
                        const PixelsOfRow& pixels) {
  const hn::CappedTag<float, (kColumns <= 4 ? 4 : 8)> d;
  constexpr int kLanes = static_cast<int>(MaxLanes(d));
  alignas(32) static constexpr float kX[8] = {0, 1, 2, 3, 4, 5, 6, 7};
  const auto real = [&](size_t field) HWY_ATTR { return hn::Set(d, batch.real(field, i)); };
  const uint32_t size = batch.at(kSizeE, i);
  const int rows = kCut ? std::min(kRows, static_cast<int>(size >> 8 & 255) - y) : kRows;
  const size_t place = batch.at(kPlaceE, i) + static_cast<size_t>(y) * stride + static_cast<size_t>(x);
  const auto one = hn::Set(d, 1.0f), xy = real(kXYE), yy = real(kYYE), code_y = real(kCodeYE);
  for (int part = 0; part < kColumns; part += kLanes) {
    const auto dx = hn::Sub(
        hn::Add(hn::Set(d, batch.real(kFirstXE, i) + static_cast<float>(x + part)), hn::Load(d, kX)), real(kCentreXE));
    const auto xx_dx = hn::Mul(real(kXXE), dx), code = hn::Add(real(kCodeE), hn::Mul(real(kCodeXE), dx));
    const int left = static_cast<int>(size & 255) - x - part;
    for (int j = 0; j < rows; ++j) {
      const auto dy = hn::Set(d, (batch.real(kFirstYE, i) + static_cast<float>(y + j)) - batch.real(kCentreYE, i));
      const auto q = hn::Add(hn::Mul(dx, hn::Add(xx_dx, hn::Mul(xy, dy))), hn::Mul(hn::Mul(yy, dy), dy));
      auto inside = hn::Le(q, one);
      if (kCut) inside = hn::And(inside, hn::FirstN(d, static_cast<size_t>(std::clamp(left, 0, kLanes))));
      pixels(std::integral_constant<int, kColumns>(), d, part,
             place + static_cast<size_t>(j) * stride + static_cast<size_t>(part), inside, q,
             hn::Add(code, hn::Mul(code_y, dy)));
    }
  }
}

// Calls pixels() for a whole splat, by the size of its box. Blocks have fixed sizes, so that no end of a loop is
// mispredicted: the splats of a view are of similar size.
template <size_t kFields, class PixelsOfRow>
HWY_INLINE void ForBlocks(const SplatBatch<kFields>& batch, size_t i, int stride, const PixelsOfRow& pixels) {
  const uint32_t size = batch.at(kSizeE, i);
  const int columns = static_cast<int>(size & 255), rows = static_cast<int>(size >> 8 & 255),
            side = std::max(columns, rows);
  if (size & kCutBit) {
    for (int y = 0; y < rows; y += 8)
      for (int x = 0; x < columns; x += 8) ForRows<true, 8, 8>(batch, i, stride, x, y, pixels);
  } else if (side <= 2) {
    ForRows<false, 2, 2>(batch, i, stride, 0, 0, pixels);
  } else if (side <= 3) {
    ForRows<false, 3, 3>(batch, i, stride, 0, 0, pixels);
  } else if (side <= 4) {
    ForRows<false, 4, 4>(batch, i, stride, 0, 0, pixels);
  } else if (side <= 5) {
    ForRows<false, 5, 5>(batch, i, stride, 0, 0, pixels);
  } else if (side <= 6) {
    ForRows<false, 6, 6>(batch, i, stride, 0, 0, pixels);
  } else {
    for (int y = 0; y < rows; y += 8)
      for (int x = 0; x < columns; x += 8) ForRows<false, 8, 8>(batch, i, stride, x, y, pixels);
  }
}

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
