// The kernel `ewa`: finds the visible surface of each pixel, then the weighted mean of all splats of that surface.
// Based on: M. Zwicker, H. Pfister, J. van Baar, M. Gross, "EWA splatting", IEEE TVCG 8(3), 2002; M. Botsch, L.
// Kobbelt, "High-quality point-based rendering on modern GPUs", 2003 (visibility with an epsilon, then accumulation and
// normalisation).
// Included once a target, by surfel/kernels.cpp.
#if defined(TELESPLAT_SPLAT_EWA_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SPLAT_EWA_INL_H_
#undef TELESPLAT_SPLAT_EWA_INL_H_
#else
#define TELESPLAT_SPLAT_EWA_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "common/splat/ewa/blocks-inl.h"
#include "common/splat/ewa/resolve-inl.h"
#include "common/splat/surfel/stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {

// Terms that splats add to EwaSum: its first four and its last four, for a whole batch. Made splat by splat, from
// scalars written and then read as a vector, each read waited for all stores before it: a seventh of the second pass.
struct EwaTerms {
  HWY_ALIGN float low[4 * SumBatch::kCapacity], high[4 * SumBatch::kCapacity];
};
HWY_INLINE void TermsOfBatch(const SumBatch& batch, EwaTerms& terms) {
  const F32 d;
  const I32 di;
  const U32 du;
  // Lanes beyond the last splat hold older ones.
  for (size_t i = 0; i < batch.count; i += hn::Lanes(d)) {
    const auto albedo = hn::Load(du, batch.fields[kAlbedoE] + i);
    const auto real = [&](size_t field) HWY_ATTR { return hn::BitCast(d, hn::Load(du, batch.fields[field] + i)); };
    const auto channel = [&](VU v)
                             HWY_ATTR { return hn::ConvertTo(d, hn::BitCast(di, hn::And(v, hn::Set(du, 255u)))); };
    const VF red = channel(hn::ShiftRight<16>(albedo)), green = channel(hn::ShiftRight<8>(albedo)),
             blue = channel(albedo);
#if HWY_TARGET == HWY_SCALAR
    const float v[8] = {hn::GetLane(red),
                        hn::GetLane(green),
                        hn::GetLane(blue),
                        1.0f,
                        hn::GetLane(real(kNormalXE)),
                        hn::GetLane(real(kNormalYE)),
                        hn::GetLane(real(kNormalZE)),
                        hn::GetLane(real(kCodeE))};
    std::copy_n(v, 4, terms.low + 4 * i), std::copy_n(v + 4, 4, terms.high + 4 * i);
#else
    hn::StoreInterleaved4(red, green, blue, Const(1.0f), d, terms.low + 4 * i);
    hn::StoreInterleaved4(real(kNormalXE), real(kNormalYE), real(kNormalZE), real(kCodeE), d, terms.high + 4 * i);
#endif
  }
}
// Loads all terms of splat i, or half of them if vectors have four lanes.
template <class D>
HWY_INLINE hn::Vec<D> TermsOf(D d, const EwaTerms& terms, size_t i, int half) {
#if HWY_TARGET != HWY_SCALAR
  if constexpr (MaxLanes(D()) == 8) {
    const hn::CappedTag<float, 4> d4;
    return hn::Combine(d, hn::Load(d4, terms.high + 4 * i), hn::Load(d4, terms.low + 4 * i));
  }
#endif
  return hn::LoadU(d, (half ? terms.high : terms.low) + 4 * i);
}

// Second pass: sums the splats of the visible surface.
HWY_NOINLINE void EwaDrawSums(const SumBatch& batch, const EwaBuffer& buffer) {
  const hn::CappedTag<float, 8> d8;
  constexpr size_t kLanes8 = MaxLanes(d8);
  const float* const visible = buffer.visible.get();
  float* const sums = buffer.sums.get();
  EwaTerms terms;
  TermsOfBatch(batch, terms);
  for (size_t i = 0; i < batch.count; ++i) {
    const float epsilon = batch.real(kEpsilonE, i), peak = batch.real(kPeakE, i);
    const auto first = TermsOf(d8, terms, i, 0), last = TermsOf(d8, terms, i, 1);
    ForBlocks(batch, i, buffer.stride,
              [&](auto columns, auto d, int part, size_t at, auto inside, auto q, auto depth) HWY_ATTR {
                const auto there = hn::LoadU(d, visible + at);
                const auto counts = hn::And(inside, hn::Le(hn::Sub(depth, hn::Set(d, epsilon)), there));
                // Without a branch on "any counts", which would be mispredicted too often.
                const auto t = hn::Sub(hn::Set(d, 1.0f), q), t2 = hn::Mul(t, t);
                HWY_ALIGN float weights[8];
                hn::Store(hn::IfThenElseZero(counts, hn::Mul(hn::Set(d, peak), hn::Mul(t2, t2))), d, weights);
                float* sum = sums + 8 * at;
                const int n = std::min<int>(decltype(columns)::value - part, MaxLanes(d));
#pragma GCC unroll 8
                for (int k = 0; k < n; ++k, sum += 8) {
                  if constexpr (kLanes8 < 4) {
                    for (int l = 0; l < 4; ++l)
                      sum[l] += weights[k] * terms.low[4 * i + l], sum[4 + l] += weights[k] * terms.high[4 * i + l];
                  } else {
                    const auto weight = hn::Set(d8, weights[k]);
                    if constexpr (kLanes8 == 4) hn::Store(hn::Add(hn::Load(d8, sum), hn::Mul(weight, first)), d8, sum);
                    float* second = sum + 8 - kLanes8;
                    hn::Store(hn::Add(hn::Load(d8, second), hn::Mul(weight, last)), d8, second);
                  }
                }
              });
  }
}

// Adds the kept splats of s to a batch of the second pass; calls batch_with_room() only if there are any.
template <class Next>
HWY_INLINE void EwaPutSums(const Surfels& s, hn::Mask<I32> keep, float near_m, const geometry::Rect& rect, int stride,
                           const Next& batch_with_room) {
  const I32 di;
  const U32 du;
  const auto det = hn::Max(DeterminantOf(s), Const(1e-12f));
  const auto grow = hn::Max(hn::Sub(Const(kSupportGrowth), hn::Div(Const(kSupportDrop), hn::Sqrt(det))), Const(1.0f));
  const Conics c = ConicOf(s, grow, kFilterVariance, rect);
  const auto drawn = hn::And(keep, hn::And(hn::Gt(c.x1, c.x0), hn::Gt(c.y1, c.y0)));
  if (hn::AllFalse(di, drawn)) return;
  SumBatch& batch = batch_with_room();
  const Compressor compress(hn::RebindMask(du, drawn));
  PutConics(batch, compress, c, DepthsOf(s, near_m), rect, stride);
  const auto put = [&](size_t field, VF v)
                       HWY_ATTR { hn::StoreU(compress(hn::BitCast(du, v)), du, batch.fields[field] + batch.count); };
  put(kEpsilonE, ShareOf(s, kEpsilonPerRadius, kLeastEpsilon, kMostEpsilon));
  put(kPeakE, hn::Div(Const(1.0f), hn::Min(c.determinant, Const(1e6f))));
  hn::StoreU(compress(s.albedo), du, batch.fields[kAlbedoE] + batch.count);
  put(kNormalXE, s.normal_x), put(kNormalYE, s.normal_y), put(kNormalZE, s.normal_z);
  batch.count += compress.count();
}

// The splats of the second pass, kept from the first so that each contour is computed once. Batches lie one after the
// other in the buffer's memory.
class EwaRecord {
 public:
  explicit EwaRecord(EwaBuffer& buffer) {
    if (!buffer.record) buffer.record = hwy::AllocateAligned<std::byte>(kBytes);
    bytes_ = buffer.record.get();
    next();
  }

  /// False: the splats did not all fit, so the tile's points must be processed again.
  bool complete() const { return !overflown_; }
  HWY_INLINE SumBatch& with_room() {
    if (HWY_UNLIKELY(batch(used_ - 1).full())) next();
    return batch(used_ - 1);
  }
  void draw(const EwaBuffer& buffer) {
    for (size_t i = 0; i < used_; ++i) EwaDrawSums(batch(i), buffer);
  }

 private:
  static constexpr size_t kBytes = EwaBuffer::kRecordSplats / SumBatch::kCapacity * sizeof(SumBatch);

  SumBatch& batch(size_t i) { return reinterpret_cast<SumBatch*>(bytes_)[i]; }
  void next() {
    // Once memory is full, splats overwrite the last batch.
    if ((used_ + 1) * sizeof(SumBatch) > kBytes)
      overflown_ = true;
    else
      ++used_;
    batch(used_ - 1).count = 0;
  }

  std::byte* bytes_;
  size_t used_ = 0;
  bool overflown_ = false;
};

// First pass: the least depth of opaque ellipses. Leaves a record for the second.
class EwaVisibility {
 public:
  // Uses the reach of the second pass, whose splats reach farther.
  static constexpr SurfelReach kReach = kEwaReach;

  EwaVisibility(const TileInput& input, const EwaBuffer& buffer, EwaRecord& record)
      : rect_(input.rect),
        near_m_(input.near_m),
        stride_(buffer.stride),
        visible_(buffer.visible.get()),
        record_(record) {
    batch_.count = 0;
  }

  HWY_INLINE void add(const Surfels& s, hn::Mask<I32> keep) {
    const F32 d;
    const I32 di;
    const U32 du;
    if (batch_.full()) flush();
    EwaPutSums(s, keep, near_m_, rect_, stride_, [&]() HWY_ATTR -> SumBatch& { return record_.with_room(); });
    const Conics c = ConicOf(s, Const(1.0f), kOpaqueVariance, rect_);
    const Depths depth = DepthsOf(s, near_m_);
    const auto in_rect = CentreIn(c, rect_);
    // Always draws the pixel that holds the centre.
    const auto centre = hn::And(keep, in_rect);
    if (!hn::AllFalse(di, centre)) {
      const auto dx = hn::Sub(hn::Add(hn::ConvertTo(d, c.pixel_x), Const(0.5f)), c.centre_x),
                 dy = hn::Sub(hn::Add(hn::ConvertTo(d, c.pixel_y), Const(0.5f)), c.centre_y);
      const auto code = hn::Add(hn::Add(depth.centre, hn::Mul(depth.x, dx)), hn::Mul(depth.y, dy));
      const auto row = hn::Sub(c.pixel_y, hn::Set(di, rect_.y)), column = hn::Sub(c.pixel_x, hn::Set(di, rect_.x));
      const Compressor compress(hn::RebindMask(du, centre));
      HWY_ALIGN uint32_t places[kMaxLanes];
      HWY_ALIGN float codes[kMaxLanes];
      hn::Store(compress(hn::BitCast(du, hn::Add(hn::Mul(row, hn::Set(di, stride_)), column))), du, places);
      hn::Store(hn::BitCast(d, compress(hn::BitCast(du, code))), d, codes);
      const size_t n = compress.count();
      for (size_t i = 0; i < n; ++i) visible_[places[i]] = std::min(visible_[places[i]], codes[i]);
    }
    const auto columns = hn::Sub(c.x1, c.x0), rows = hn::Sub(c.y1, c.y0), one = hn::Set(di, 1), none = hn::Zero(di);
    const auto only_centre = hn::And(hn::And(hn::Eq(columns, one), hn::Eq(rows, one)),
                                     hn::And(hn::Eq(c.x0, c.pixel_x), hn::Eq(c.y0, c.pixel_y)));
    const auto more = hn::AndNot(only_centre, hn::And(keep, hn::And(hn::Gt(columns, none), hn::Gt(rows, none))));
    if (hn::AllFalse(di, more)) return;
    const Compressor compress(hn::RebindMask(du, more));
    PutConics(batch_, compress, c, depth, rect_, stride_);
    batch_.count += compress.count();
  }

  void flush() {
    for (size_t i = 0; i < batch_.count; ++i)
      ForBlocks(batch_, i, stride_, [&](auto, auto d, int, size_t at, auto inside, auto, auto depth) HWY_ATTR {
        const auto there = hn::LoadU(d, visible_ + at);
        hn::StoreU(hn::IfThenElse(inside, hn::Min(there, depth), there), d, visible_ + at);
      });
    batch_.count = 0;
  }

 private:
  const geometry::Rect rect_;
  const float near_m_;
  const int stride_;
  float* const visible_;
  EwaRecord& record_;
  EwaBatch batch_;
};

// Second pass for records that overflowed: processes the points again.
class EwaAccumulation {
 public:
  static constexpr SurfelReach kReach = kEwaReach;

  EwaAccumulation(const TileInput& input, const EwaBuffer& buffer)
      : rect_(input.rect), near_m_(input.near_m), buffer_(buffer) {
    batch_.count = 0;
  }
  HWY_INLINE void add(const Surfels& s, hn::Mask<I32> keep) {
    if (batch_.full()) flush();
    EwaPutSums(s, keep, near_m_, rect_, buffer_.stride, [&]() HWY_ATTR -> SumBatch& { return batch_; });
  }
  void flush() {
    EwaDrawSums(batch_, buffer_);
    batch_.count = 0;
  }

 private:
  const geometry::Rect rect_;
  const float near_m_;
  const EwaBuffer& buffer_;
  SumBatch batch_;
};

// Buffers are empty between tiles: resolving empties them, except for the pixels beyond the tile into which splats hang
// over. Only a larger tile would read those.
void PrepareEwa(const geometry::Rect& rect, EwaBuffer& buffer) {
  if (buffer.width == rect.width && buffer.height == rect.height) return;
  const int stride = (rect.width + kMaxSplatSide + 7) / 8 * 8, rows = rect.height + kMaxSplatSide;
  const size_t pixels = static_cast<size_t>(stride) * rows;
  if (pixels > buffer.pixels) {
    buffer.visible = hwy::AllocateAligned<float>(pixels);
    buffer.sums = hwy::AllocateAligned<float>(8 * pixels);
    buffer.pixels = pixels;
  }
  buffer.width = rect.width, buffer.height = rect.height, buffer.stride = stride;
  std::fill_n(buffer.visible.get(), pixels, kNothingVisible);
  std::memset(buffer.sums.get(), 0, 8 * pixels * sizeof(float));
}

TileCounts EwaTile(const TileInput& input, const SurfelInput& surfels, const EwaLight& light, EwaBuffer& buffer,
                   const ResolvedTile& tile, int reach) {
  PrepareEwa(input.rect, buffer);
  EwaRecord record(buffer);
  EwaVisibility visibility(input, buffer, record);
  const TileCounts counts = SurfelStream<EwaVisibility>(input, surfels, visibility).run();
  visibility.flush();
  if (record.complete()) {
    record.draw(buffer);
  } else {
    EwaAccumulation accumulation(input, buffer);
    SurfelStream<EwaAccumulation>(input, surfels, accumulation).run();
    accumulation.flush();
  }
  EwaResolve(light, buffer, tile, reach);
  return counts;
}

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
