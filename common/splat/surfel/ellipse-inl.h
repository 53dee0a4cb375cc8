// The kernel `ellipse`: one pass, opaque, the plane's depth and a paraboloid of bias in each pixel.
// Included once a target, by surfel/kernels.cpp.
#if defined(TELESPLAT_SPLAT_ELLIPSE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SPLAT_ELLIPSE_INL_H_
#undef TELESPLAT_SPLAT_ELLIPSE_INL_H_
#else
#define TELESPLAT_SPLAT_ELLIPSE_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "common/splat/surfel/stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {

class EllipseSink {
 public:
  static constexpr SurfelReach kReach = kEllipseReach;
  EllipseSink(const TileInput& input, const SurfelInput& surfels, const KeyBuffer& buffer)
      : rect_(input.rect), near_m_(input.near_m), limits_(surfels.limits), buffer_(buffer) {}

  HWY_INLINE void add(const Surfels& s, hn::Mask<I32> keep) {
    const F32 d;
    const I32 di;
    const auto one = hn::Set(di, 1);
    if (count_ + kMaxLanes > kCapacity) flush();
    const Conics c = ConicOf(s, Const(1.0f), kOpaqueVariance, rect_);
    const Depths depth = DepthsOf(s, near_m_);
    const auto bias = hn::Min(ShareOf(s, kBiasPerRadius, kLeastBias, kMostBias), Const(static_cast<float>(kMaxBias)));
    const SharedKey shared = shared_key(s);

    // The pixel that holds the centre is drawn separately if the ellipse covers no other pixel or misses this one.
    const auto half = Const(0.5f);
    const auto dx = hn::Sub(hn::Add(hn::ConvertTo(d, c.pixel_x), half), c.centre_x),
               dy = hn::Sub(hn::Add(hn::ConvertTo(d, c.pixel_y), half), c.centre_y);
    const auto q = At(c.xx, c.xy, c.yy, dx, dy);
    const auto columns = hn::Sub(c.x1, c.x0), rows = hn::Sub(c.y1, c.y0);
    const auto tall = hn::And(hn::Gt(columns, hn::Zero(di)), hn::Gt(rows, hn::Zero(di)));
    const auto small = hn::Not(hn::Or(hn::Gt(columns, one), hn::Gt(rows, one)));
    const auto many = hn::And(keep, hn::AndNot(small, tall));
    const auto in_rect = CentreIn(c, rect_);
    const auto missed = hn::Not(hn::RebindMask(di, hn::Le(q, Const(1.0f))));
    // A box of one pixel may be cut from a larger one whose centre lies in another pixel: then it is drawn like larger
    // boxes.
    const auto elsewhere =
        hn::And(hn::And(keep, hn::And(small, tall)), hn::Or(hn::Ne(c.x0, c.pixel_x), hn::Ne(c.y0, c.pixel_y)));
    const auto single = hn::And(hn::And(keep, in_rect), hn::Or(small, missed));
    if (!hn::AllFalse(di, single)) {
      const auto code = hn::Add(hn::Add(hn::Add(depth.centre, hn::Mul(depth.x, dx)), hn::Mul(depth.y, dy)),
                                hn::Mul(bias, hn::Min(q, Const(1.0f))));
      draw_centres(c, single, code, q, shared);
    }
    const auto common = hn::Or(many, elsewhere);
    if (!hn::AllFalse(di, common)) enqueue(c, common, depth, bias, shared);
  }

  void flush() {
    for (size_t i = 0; i < count_; ++i) {
      // Most splats fit into four by four pixels, and are drawn without a loop whose end could be mispredicted: pixels
      // outside the ellipse stay unchanged.
      const uint32_t size = batch_[kSize][i];
      if ((size & 255) <= 4 && size >> 8 <= 4)
        draw<false>(i, 4, size >> 8 <= 2 ? 2 : 4);
      else if (size >> 16)
        draw<true>(i, size & 255, size >> 8 & 255);
      else
        draw<false>(i, size & 255, size >> 8 & 255);
    }
    count_ = 0;
  }

 private:
  enum Field {
    kPlace,
    kSize,
    kFirstX,
    kFirstY,
    kCentreX,
    kCentreY,
    kXX,
    kXY,
    kYY,
    kCode,
    kCodeX,
    kCodeY,
    kBias,
    kHigh,
    kLow,
    kFields
  };
  static constexpr size_t kCapacity = 256;

  // The part of the key that all pixels of a splat share.
  struct SharedKey {
    VU high, low;
  };
  HWY_INLINE SharedKey shared_key(const Surfels& s) const {
    const I32 di;
    const U32 du;
    const auto one = hn::Set(di, 1);
    const auto det = DeterminantOf(s);
    const auto reached = [&](float limit) HWY_ATTR {
      return hn::IfThenElseZero(hn::RebindMask(di, hn::Ge(det, Const(limit))), one);
    };
    const auto spacing = hn::Add(hn::Add(reached(limits_[0]), reached(limits_[1])), reached(limits_[2]));
    const auto high =
        hn::Or(hn::Or(hn::ShiftLeft<kKeyClassBit - 32>(hn::BitCast(du, spacing)), hn::ShiftRight<8>(s.normal_code)),
               hn::Set(du, 0x80000000u));
    const auto low = hn::Or(hn::ShiftLeft<24>(s.normal_code), s.albedo);
    return {high, low};
  }

  // Index of a pixel in the buffer.
  HWY_INLINE VU place_of(VI x, VI y) const {
    const I32 di;
    const auto row = hn::Sub(y, hn::Set(di, rect_.y - buffer_.margin)),
               column = hn::Sub(x, hn::Set(di, rect_.x - buffer_.margin));
    return hn::BitCast(U32(), hn::Add(hn::Mul(row, hn::Set(di, buffer_.stride)), column));
  }

  // Draws the pixels that hold the centres. code: their depth codes with bias.
  HWY_INLINE void draw_centres(const Conics& c, hn::Mask<I32> wanted, VF code, VF q, const SharedKey& shared) {
    const F32 d;
    const I32 di;
    const U32 du;
    const auto whole = hn::BitCast(du, hn::ConvertTo(di, Clamp(code, hn::Zero(d), Const(kMaxDepthCode))));
    const auto ring = hn::BitCast(du, hn::ConvertTo(di, hn::Min(hn::Mul(Const(8.0f), q), Const(7.0f))));
    const auto key =
        hn::Or(hn::Or(hn::ShiftLeft<kKeyDepthBit - 32>(whole), hn::ShiftLeft<kKeyRingBit - 32>(ring)), shared.high);
    HWY_ALIGN uint32_t places[kMaxLanes];
    HWY_ALIGN uint64_t keys[kMaxLanes];
    const Compressor compress(hn::RebindMask(du, wanted));
    hn::Store(compress(place_of(c.pixel_x, c.pixel_y)), du, places);
    hn::StoreInterleaved2(compress(shared.low), compress(key), du, reinterpret_cast<uint32_t*>(keys));
    const size_t n = compress.count();
    auto* pixels = reinterpret_cast<int64_t*>(buffer_.keys);
    for (size_t i = 0; i < n; ++i) pixels[places[i]] = std::min(pixels[places[i]], static_cast<int64_t>(keys[i]));
  }

  // Adds splats to the batch.
  HWY_INLINE void enqueue(const Conics& c, hn::Mask<I32> wanted, const Depths& depth, VF bias,
                          const SharedKey& shared) {
    const F32 d;
    const I32 di;
    const U32 du;
    const auto half = Const(0.5f);
    const Compressor compress(hn::RebindMask(du, wanted));
    const auto put = [&](Field field, VU v) HWY_ATTR { hn::StoreU(compress(v), du, batch_[field] + count_); };
    const auto put_float = [&](Field field, VF v) HWY_ATTR { put(field, hn::BitCast(du, v)); };
    put(kPlace, place_of(c.x0, c.y0));
    put(kSize, hn::BitCast(du, hn::Or(hn::Or(hn::Sub(c.x1, c.x0), hn::ShiftLeft<8>(hn::Sub(c.y1, c.y0))),
                                      hn::IfThenElseZero(c.cut, hn::Set(di, 1 << 16)))));
    put_float(kFirstX, hn::Add(hn::ConvertTo(d, c.x0), half));
    put_float(kFirstY, hn::Add(hn::ConvertTo(d, c.y0), half));
    put_float(kCentreX, c.centre_x), put_float(kCentreY, c.centre_y);
    put_float(kXX, c.xx), put_float(kXY, c.xy), put_float(kYY, c.yy);
    put_float(kCode, depth.centre), put_float(kCodeX, depth.x), put_float(kCodeY, depth.y);
    put_float(kBias, bias);
    put(kHigh, shared.high), put(kLow, shared.low);
    count_ += compress.count();
  }

#if HWY_TARGET == HWY_SCALAR
  template <bool kCut>
  void draw(size_t i, uint32_t columns, uint32_t rows) {
    const auto real = [&](Field field) { return std::bit_cast<float>(batch_[field][i]); };
    for (uint32_t y = 0; y < rows; ++y)
      for (uint32_t x = 0; x < columns; ++x) {
        const float dx = (real(kFirstX) + static_cast<float>(x)) - real(kCentreX),
                    dy = (real(kFirstY) + static_cast<float>(y)) - real(kCentreY);
        const float q = dx * (real(kXX) * dx + real(kXY) * dy) + (real(kYY) * dy) * dy;
        if (!(q <= 1.0f)) continue;
        const float depth = ((real(kCode) + real(kCodeX) * dx) + real(kCodeY) * dy) + real(kBias) * q;
        const auto code = static_cast<uint32_t>(std::clamp(depth, 0.0f, static_cast<float>(kMaxDepthCode)));
        const auto ring = static_cast<uint32_t>(static_cast<int32_t>(std::min(8.0f * q, 7.0f)));
        const uint32_t high = code << (kKeyDepthBit - 32) | ring << (kKeyRingBit - 32) | batch_[kHigh][i];
        auto& at =
            reinterpret_cast<int64_t&>(buffer_.keys[batch_[kPlace][i] + static_cast<size_t>(y) * buffer_.stride + x]);
        at = std::min(at, static_cast<int64_t>(uint64_t{high} << 32 | batch_[kLow][i]));
      }
  }
#else
  // Draws two rows of pixels at a time, half a vector of each, so that interleaving within blocks joins the halves of
  // keys: 8 lanes are the pixels 0 1 of both rows, then 2 3. Every target uses groups of four pixels, and so covers the
  // same pixels.
  //   kCut: the box ends before the ellipse does, so pixels beyond the box are left out.
  template <bool kCut>
  HWY_INLINE void draw(size_t i, uint32_t columns, uint32_t rows) {
    const hn::CappedTag<float, 8> d;
    const hn::RebindToSigned<decltype(d)> di;
    const hn::RebindToUnsigned<decltype(d)> du;
    const hn::Repartition<int64_t, decltype(d)> d64;
    constexpr size_t kHalf = HWY_MAX(MaxLanes(d), 4) / 2;
    alignas(32) static constexpr float kX[8] = {0, 1, 0, 1, 2, 3, 2, 3}, kY[8] = {0, 0, 1, 1, 0, 0, 1, 1};
    const auto real = [&](Field field) HWY_ATTR { return hn::BitCast(d, hn::Set(du, batch_[field][i])); };
    const auto along = hn::Load(d, kX), across = hn::Load(d, kY);
    const auto first_x = hn::Add(real(kFirstX), along), centre_x = real(kCentreX), centre_y = real(kCentreY);
    const auto xx = real(kXX), xy = real(kXY), yy = real(kYY);
    const auto code = real(kCode), code_x = real(kCodeX), code_y = real(kCodeY), bias = real(kBias);
    const auto high = hn::Set(du, batch_[kHigh][i]), low = hn::Set(du, batch_[kLow][i]);
    const auto one = hn::Set(d, 1.0f), zero = hn::Zero(d), most = hn::Set(d, static_cast<float>(kMaxDepthCode));
    const auto eight = hn::Set(d, 8.0f), seven = hn::Set(d, 7.0f), two = hn::Set(d, 2.0f);
    const auto outside = hn::Set(du, 0x7fffffffu);
    const auto stride = static_cast<size_t>(buffer_.stride);
    uint64_t* row = buffer_.keys + batch_[kPlace][i];
    auto y = hn::Add(real(kFirstY), across);
    for (uint32_t j = 0; j < rows; j += 2, row += 2 * stride, y = hn::Add(y, two)) {
      const auto dy = hn::Sub(y, centre_y);
      const auto xy_dy = hn::Mul(xy, dy), yy_dy = hn::Mul(hn::Mul(yy, dy), dy), code_dy = hn::Mul(code_y, dy);
      auto x = first_x;
      for (uint32_t k = 0; k < columns; k += 4) {
        for (size_t part = 0; part < 4; part += kHalf, x = hn::Add(x, hn::Set(d, static_cast<float>(kHalf)))) {
          const auto dx = hn::Sub(x, centre_x);
          const auto q = hn::Add(hn::Mul(dx, hn::Add(hn::Mul(xx, dx), xy_dy)), yy_dy);
          auto inside = hn::Le(q, one);
          if (kCut) {
            const auto in_x = hn::Lt(hn::Sub(x, real(kFirstX)), hn::Set(d, static_cast<float>(columns))),
                       in_y = hn::Lt(hn::Sub(y, real(kFirstY)), hn::Set(d, static_cast<float>(rows)));
            inside = hn::And(inside, hn::And(in_x, in_y));
          }
          const auto depth = hn::Add(hn::Add(hn::Add(code, hn::Mul(code_x, dx)), code_dy), hn::Mul(bias, q));
          const auto whole = hn::BitCast(du, hn::ConvertTo(di, hn::Min(hn::Max(depth, zero), most)));
          const auto ring = hn::BitCast(du, hn::ConvertTo(di, hn::Min(hn::Mul(eight, q), seven)));
          const auto key =
              hn::Or(hn::Or(hn::ShiftLeft<kKeyDepthBit - 32>(whole), hn::ShiftLeft<kKeyRingBit - 32>(ring)), high);
          const auto top = hn::IfThenElse(hn::RebindMask(du, inside), key, outside);
          const auto keep_least = [&](uint64_t* at, decltype(low) keys) HWY_ATTR {
            auto* p = reinterpret_cast<int64_t*>(at);
            hn::StoreU(hn::Min(hn::LoadU(d64, p), hn::BitCast(d64, keys)), d64, p);
          };
          uint64_t* at = row + k + part;
          keep_least(at, hn::InterleaveLower(du, low, top));
          keep_least(at + stride, hn::InterleaveUpper(du, low, top));
        }
      }
    }
  }

#endif

  const geometry::Rect rect_;
  const float near_m_;
  const SpacingLimits limits_;
  const KeyBuffer buffer_;
  size_t count_ = 0;
  HWY_ALIGN uint32_t batch_[kFields][kCapacity + kMaxLanes];
};

TileCounts EllipseTile(const TileInput& input, const SurfelInput& surfels, const KeyBuffer& buffer) {
  EllipseSink sink(input, surfels, buffer);
  const TileCounts counts = SurfelStream<EllipseSink>(input, surfels, sink).run();
  sink.flush();
  return counts;
}

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
