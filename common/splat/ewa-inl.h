// The kernel `ewa`: which surface is visible in each pixel, then the weighted mean of all splats of that surface.
// Based on: M. Zwicker, H. Pfister, J. van Baar, M. Gross, "EWA splatting", IEEE TVCG 8(3), 2002; M. Botsch, L. Kobbelt,
// "High-quality point-based rendering on modern GPUs", 2003 (visibility with an epsilon, then accumulation and normalisation).
// Included once a target, by surfel_kernels.cpp.
#if defined(TELESPLAT_SPLAT_EWA_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SPLAT_EWA_INL_H_
#undef TELESPLAT_SPLAT_EWA_INL_H_
#else
#define TELESPLAT_SPLAT_EWA_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <limits>

#include "common/splat/surfel-inl.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {

constexpr float kNothingVisible = std::numeric_limits<float>::infinity();

// Four pixels of a row at once (one, where vectors have one lane).
using Quad = hn::CappedTag<float, 4>;
using QuadV = hn::Vec<Quad>;
constexpr int kQuad = static_cast<int>(MaxLanes(Quad()));

// What both passes keep of splats until they are drawn: arrays of one field each.
template <size_t kFields>
struct SplatBatch {
  static constexpr size_t kCapacity = 256;
  HWY_ALIGN uint32_t fields[kFields][kCapacity + kMaxLanes];
  size_t count = 0;

  bool full() const { return count + kMaxLanes > kCapacity; }
  uint32_t at(size_t field, size_t i) const { return fields[field][i]; }
  float real(size_t field, size_t i) const {
    float v;
    std::memcpy(&v, &fields[field][i], sizeof v);
    return v;
  }
};

// The fields of both passes; those of their own follow.
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
  kEwaFields
};

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
  put(kSizeE, hn::BitCast(du, hn::Or(hn::Sub(c.x1, c.x0), hn::ShiftLeft<8>(hn::Sub(c.y1, c.y0)))));
  put_float(kFirstXE, hn::Add(hn::ConvertTo(d, c.x0), Const(0.5f)));
  put_float(kFirstYE, hn::Add(hn::ConvertTo(d, c.y0), Const(0.5f)));
  put_float(kCentreXE, c.centre_x), put_float(kCentreYE, c.centre_y);
  put_float(kXXE, c.xx), put_float(kXYE, c.xy), put_float(kYYE, c.yy);
  put_float(kCodeE, depth.centre), put_float(kCodeXE, depth.x), put_float(kCodeYE, depth.y);
}

// Calls pixels(index of the first, how many of the four belong to the box, offset x, offset y, q) for groups of four pixels.
template <size_t kFields, class Pixels4>
HWY_INLINE void ForQuads(const SplatBatch<kFields>& batch, size_t i, int stride, const Pixels4& pixels) {
  const Quad d;
  alignas(16) static constexpr float kX[4] = {0, 1, 2, 3};
  const uint32_t size = batch.at(kSizeE, i);
  const int columns = static_cast<int>(size & 255), rows = static_cast<int>(size >> 8);
  const auto real = [&](size_t field) HWY_ATTR { return hn::Set(d, batch.real(field, i)); };
  const auto first_x = hn::Add(real(kFirstXE), hn::Load(d, kX)), centre_x = real(kCentreXE), centre_y = real(kCentreYE);
  const auto xx = real(kXXE), xy = real(kXYE), yy = real(kYYE);
  auto y = real(kFirstYE);
  size_t row = batch.at(kPlaceE, i);
  for (int j = 0; j < rows; ++j, row += static_cast<size_t>(stride), y = hn::Add(y, hn::Set(d, 1.0f))) {
    const auto dy = hn::Sub(y, centre_y);
    const auto xy_dy = hn::Mul(xy, dy), yy_dy = hn::Mul(hn::Mul(yy, dy), dy);
    auto x = first_x;
    for (int k = 0; k < columns; k += kQuad, x = hn::Add(x, hn::Set(d, static_cast<float>(kQuad)))) {
      const auto dx = hn::Sub(x, centre_x);
      pixels(row + static_cast<size_t>(k), columns - k, dx, dy,
             hn::Add(hn::Mul(dx, hn::Add(hn::Mul(xx, dx), xy_dy)), yy_dy));
    }
  }
}

// Lanes of a group that lie in the box.
HWY_INLINE hn::Mask<Quad> InBox(int left) { return hn::FirstN(Quad(), static_cast<size_t>(std::min(left, kQuad))); }

// First pass: the least depth of opaque ellipses.
class EwaVisibility {
 public:
  // As EllipseSink's.
  static constexpr float kGrowth = 1.0f, kLeastReach = 1.5f;

  EwaVisibility(const TileInput& input, const EwaBuffer& buffer)
      : rect_(input.rect), near_m_(input.near_m), stride_(buffer.stride), visible_(buffer.visible.get()) {}

  HWY_INLINE void add(const Surfels& s, hn::Mask<I32> keep) {
    const F32 d;
    const I32 di;
    const U32 du;
    if (batch_.full()) flush();
    const Conics c = ConicOf(s, Const(1.0f), kOpaqueVariance, rect_);
    const Depths depth = DepthsOf(s, near_m_);
    const auto in_rect = CentreIn(c, rect_);
    // The pixel that holds the centre, always.
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
    const Quad d;
    for (size_t i = 0; i < batch_.count; ++i) {
      const auto code = hn::Set(d, batch_.real(kCodeE, i)), code_x = hn::Set(d, batch_.real(kCodeXE, i)),
                 code_y = hn::Set(d, batch_.real(kCodeYE, i));
      ForQuads(batch_, i, stride_, [&](size_t at, int left, QuadV dx, QuadV dy, QuadV q) HWY_ATTR {
        const auto depth = hn::Add(hn::Add(code, hn::Mul(code_x, dx)), hn::Mul(code_y, dy));
        const auto inside = hn::And(hn::Le(q, hn::Set(d, 1.0f)), InBox(left));
        const auto there = hn::LoadU(d, visible_ + at);
        hn::StoreU(hn::IfThenElse(inside, hn::Min(there, depth), there), d, visible_ + at);
      });
    }
    batch_.count = 0;
  }

 private:
  const geometry::Rect rect_;
  const float near_m_;
  const int stride_;
  float* const visible_;
  SplatBatch<kEwaFields> batch_;
};

// Second pass: sums of what lies on the visible surface.
class EwaAccumulation {
 public:
  // As EllipseSink's; the square root of kSupportGrowth lies below.
  static constexpr float kGrowth = 1.6f, kLeastReach = 2.0f;
  static_assert(kGrowth * kGrowth >= kSupportGrowth);

  EwaAccumulation(const TileInput& input, const EwaBuffer& buffer)
      : rect_(input.rect),
        near_m_(input.near_m),
        stride_(buffer.stride),
        visible_(buffer.visible.get()),
        sums_(buffer.sums.get()) {}

  HWY_INLINE void add(const Surfels& s, hn::Mask<I32> keep) {
    const I32 di;
    const U32 du;
    if (batch_.full()) flush();
    const auto det = hn::Max(DeterminantOf(s), Const(1e-12f));
    const auto grow = hn::Max(hn::Sub(Const(kSupportGrowth), hn::Div(Const(kSupportDrop), hn::Sqrt(det))), Const(1.0f));
    const Conics c = ConicOf(s, grow, kFilterVariance, rect_);
    const auto touches = hn::And(hn::Gt(c.x1, c.x0), hn::Gt(c.y1, c.y0));
    const auto drawn = hn::And(keep, touches);
    if (hn::AllFalse(di, drawn)) return;
    const Depths depth = DepthsOf(s, near_m_);
    const Compressor compress(hn::RebindMask(du, drawn));
    PutConics(batch_, compress, c, depth, rect_, stride_);
    const auto put = [&](size_t field, VF v) HWY_ATTR {
      hn::StoreU(compress(hn::BitCast(du, v)), du, batch_.fields[field] + batch_.count);
    };
    put(kEpsilon, ShareOf(s, kEpsilonPerRadius, kLeastEpsilon, kMostEpsilon));
    put(kPeak, hn::Div(Const(1.0f), hn::Min(c.determinant, Const(1e6f))));
    hn::StoreU(compress(s.albedo), du, batch_.fields[kAlbedo] + batch_.count);
    put(kNormalX, s.normal_x), put(kNormalY, s.normal_y), put(kNormalZ, s.normal_z);
    batch_.count += compress.count();
  }

  void flush() {
    const Quad d;
    const hn::CappedTag<float, 8> d8;
    constexpr size_t kLanes8 = MaxLanes(d8);
    for (size_t i = 0; i < batch_.count; ++i) {
      const auto code = hn::Set(d, batch_.real(kCodeE, i)), code_x = hn::Set(d, batch_.real(kCodeXE, i)),
                 code_y = hn::Set(d, batch_.real(kCodeYE, i)), epsilon = hn::Set(d, batch_.real(kEpsilon, i)),
                 peak = hn::Set(d, batch_.real(kPeak, i));
      const uint32_t albedo = batch_.at(kAlbedo, i);
      // As EwaSum.
      HWY_ALIGN const float values[8] = {static_cast<float>(albedo >> 16), static_cast<float>(albedo >> 8 & 255),
                                         static_cast<float>(albedo & 255), 1.0f,
                                         batch_.real(kNormalX, i),         batch_.real(kNormalY, i),
                                         batch_.real(kNormalZ, i),         batch_.real(kCodeE, i)};
      const auto first = hn::Load(d8, values), last = hn::Load(d8, values + 8 - kLanes8);
      ForQuads(batch_, i, stride_, [&](size_t at, int left, QuadV dx, QuadV dy, QuadV q) HWY_ATTR {
        const auto depth = hn::Add(hn::Add(code, hn::Mul(code_x, dx)), hn::Mul(code_y, dy));
        const auto there = hn::LoadU(d, visible_ + at);
        const auto counts =
            hn::And(hn::And(hn::Le(q, hn::Set(d, 1.0f)), hn::Le(hn::Sub(depth, epsilon), there)), InBox(left));
        // No branch on whether any counts, nor on how many are in the box: both would be guessed wrong too often.
        const auto t = hn::Sub(hn::Set(d, 1.0f), q), t2 = hn::Mul(t, t);
        HWY_ALIGN float weights[4];
        hn::Store(hn::IfThenElseZero(counts, hn::Mul(peak, hn::Mul(t2, t2))), d, weights);
        float* sum = sums_ + 8 * at;
        for (int k = 0; k < kQuad; ++k, sum += 8) {
          if constexpr (kLanes8 < 4) {
            for (int l = 0; l < 8; ++l) sum[l] += weights[k] * values[l];
            continue;
          }
          const auto weight = hn::Set(d8, weights[k]);
          if constexpr (kLanes8 == 4) hn::Store(hn::Add(hn::Load(d8, sum), hn::Mul(weight, first)), d8, sum);
          float* second = sum + 8 - kLanes8;
          hn::Store(hn::Add(hn::Load(d8, second), hn::Mul(weight, last)), d8, second);
        }
      });
    }
    batch_.count = 0;
  }

 private:
  enum { kEpsilon = kEwaFields, kPeak, kAlbedo, kNormalX, kNormalY, kNormalZ, kFields };
  const geometry::Rect rect_;
  const float near_m_;
  const int stride_;
  const float* const visible_;
  float* const sums_;
  SplatBatch<kFields> batch_;
};

// ewa_colour and ewa_depth_code of whole rows.
#if HWY_TARGET == HWY_SCALAR
void EwaResolve(const EwaLight& light, const EwaBuffer& buffer, const ResolvedTile& tile, int reach,
                uint32_t background) {
  for (int y = 0; y < buffer.height; ++y)
    for (int x = 0; x < buffer.width; ++x) {
      const size_t at = static_cast<size_t>(y) * buffer.stride + x;
      const float* v = buffer.sums.get() + 8 * at;
      const EwaSum sum{v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7]};
      const bool shown = buffer.visible[at] < kNothingVisible;
      tile.colour(y - reach)[x - reach] = shown ? ewa_colour(sum, light) : background;
      tile.info(y - reach)[x - reach] = shown ? ewa_depth_code(sum) << 8 : kEmptyInfo;
    }
}
#else
void EwaResolve(const EwaLight& light, const EwaBuffer& buffer, const ResolvedTile& tile, int reach,
                uint32_t background) {
  const hn::CappedTag<float, 8> d;
  const hn::RebindToSigned<decltype(d)> di;
  const hn::RebindToUnsigned<decltype(d)> du;
  using V = hn::Vec<decltype(d)>;
  const size_t lanes = hn::Lanes(d);
  const auto one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f);
  for (int y = 0; y < buffer.height; ++y) {
    uint32_t *colours = tile.colour(y - reach) - reach, *infos = tile.info(y - reach) - reach;
    for (size_t x = 0; x < static_cast<size_t>(buffer.width); x += lanes) {
      const size_t at = static_cast<size_t>(y) * buffer.stride + x;
      const auto shown = hn::Lt(hn::LoadU(d, buffer.visible.get() + at), hn::Set(d, kNothingVisible));
      const auto empty = hn::Set(du, kEmptyInfo), paper = hn::Set(du, background);
      if (hn::AllFalse(d, shown)) {
        hn::StoreU(paper, du, colours + x);
        hn::StoreU(empty, du, infos + x);
        continue;
      }
      // Every pixel is two groups of four: they come out by turns.
      const float* sum = buffer.sums.get() + 8 * at;
      V a0, a1, a2, a3, b0, b1, b2, b3;
      hn::LoadInterleaved4(d, sum, a0, a1, a2, a3);
      hn::LoadInterleaved4(d, sum + 4 * lanes, b0, b1, b2, b3);
      const auto red = hn::ConcatEven(d, b0, a0), green = hn::ConcatEven(d, b1, a1), blue = hn::ConcatEven(d, b2, a2),
                 weight = hn::ConcatEven(d, b3, a3);
      const auto nx = hn::ConcatOdd(d, b0, a0), ny = hn::ConcatOdd(d, b1, a1), nz = hn::ConcatOdd(d, b2, a2),
                 codes = hn::ConcatOdd(d, b3, a3);
      const auto length2 = hn::Add(hn::Add(hn::Mul(nx, nx), hn::Mul(ny, ny)), hn::Mul(nz, nz));
      const auto scale = hn::Div(one, hn::Sqrt(hn::Max(length2, hn::Set(d, 1e-30f))));
      const auto head = hn::Mul(hn::Abs(nz), scale);
      const auto towards_key = hn::Add(
          hn::Add(hn::Mul(nx, hn::Set(d, light.key_direction[0])), hn::Mul(ny, hn::Set(d, light.key_direction[1]))),
          hn::Mul(nz, hn::Set(d, light.key_direction[2])));
      const auto key = hn::Max(hn::Mul(towards_key, scale), hn::Zero(d));
      const auto lit = hn::Add(hn::Add(hn::Set(d, light.ambient), hn::Mul(hn::Set(d, light.head), head)),
                               hn::Mul(hn::Set(d, light.key), key));
      const auto intensity = hn::Max(hn::Min(lit, one), hn::Zero(d));
      const auto per_weight = hn::Div(intensity, weight);
      const auto channel = [&](V v) HWY_ATTR {
        const auto c = hn::Min(hn::Add(hn::Mul(v, per_weight), half), hn::Set(d, 255.0f));
        return hn::BitCast(du, hn::ConvertTo(di, c));
      };
      const auto colour =
          hn::Or(hn::Or(hn::ShiftLeft<16>(channel(red)), hn::ShiftLeft<8>(channel(green))), channel(blue));
      const auto mean = hn::Min(hn::Add(hn::Div(codes, weight), half), hn::Set(d, static_cast<float>(kMaxDepthCode)));
      const auto code = hn::BitCast(du, hn::ConvertTo(di, hn::Max(mean, hn::Zero(d))));
      const auto is_shown = hn::RebindMask(du, shown);
      hn::StoreU(hn::IfThenElse(is_shown, colour, paper), du, colours + x);
      hn::StoreU(hn::IfThenElse(is_shown, hn::ShiftLeft<8>(code), empty), du, infos + x);
    }
  }
}

#endif

void ClearEwa(const geometry::Rect& rect, EwaBuffer& buffer) {
  // Groups of pixels may reach beyond a row, and so may vectors of the last pixels.
  constexpr int kBeyond = 16;
  const int stride = (rect.width + kBeyond + 7) / 8 * 8;
  const size_t pixels = static_cast<size_t>(stride) * rect.height;
  if (buffer.room < pixels) {
    buffer.visible = hwy::AllocateAligned<float>(pixels);
    buffer.sums = hwy::AllocateAligned<float>(8 * pixels);
    buffer.room = pixels;
  }
  buffer.width = rect.width, buffer.height = rect.height, buffer.stride = stride;
  std::fill_n(buffer.visible.get(), pixels, kNothingVisible);
  std::memset(buffer.sums.get(), 0, 8 * pixels * sizeof(float));
}

TileCounts EwaTile(const TileInput& input, const SurfelInput& surfels, const EwaLight& light, EwaBuffer& buffer,
                   const ResolvedTile& tile, int reach, uint32_t background) {
  ClearEwa(input.rect, buffer);
  EwaVisibility visibility(input, buffer);
  const TileCounts counts = SurfelStream<EwaVisibility>(input, surfels, visibility).run();
  visibility.flush();
  EwaAccumulation accumulation(input, buffer);
  SurfelStream<EwaAccumulation>(input, surfels, accumulation).run();
  accumulation.flush();
  EwaResolve(light, buffer, tile, reach, background);
  return counts;
}

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
