// Composites a pixel row of a slice behind the layer's pixels so far, and writes a layer's pixels when it is done.
#if defined(TELESPLAT_SHEAR_COMPOSITE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SHEAR_COMPOSITE_INL_H_
#undef TELESPLAT_SHEAR_COMPOSITE_INL_H_
#else
#define TELESPLAT_SHEAR_COMPOSITE_INL_H_
#endif

#include <cstddef>

#include "services/sampler/volume/shear/resample-inl.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::sampler::HWY_NAMESPACE {

// Pixels of a tile's layer: premultiplied colour so far and the light that is left.
struct TilePixels {
  uint64_t live[kTileHeight];     // blocks that are not opaque yet
  uint64_t touched[kTileHeight];  // blocks that hold values
  alignas(64) float at[kTileHeight][kTileBlocks * kBlockFloats];
};

alignas(64) inline constexpr float kNothing[kBlockFloats] = {};

// (1 - exp(-x)) / x for x >= 0, as R / (1 + x R) with R a polynomial fitted to (exp(x) - 1) / x such that 1 - x R / (1
// + x R) is exp(-x) to 2.3e-4 (and to 2.3e-4 x for small x). Neither cancels nor divides by 0, unlike the exponential
// itself.
template <class V>
HWY_INLINE V Attenuation(V x) {
  const hn::DFromV<V> d;
  auto r = hn::Set(d, 0.008409365936699015f);
  r = hn::Add(hn::Mul(r, x), hn::Set(d, -0.025300757950867243f));
  r = hn::Add(hn::Mul(r, x), hn::Set(d, 0.09847256575983211f));
  r = hn::Add(hn::Mul(r, x), hn::Set(d, 0.1318903134986669f));
  r = hn::Add(hn::Mul(r, x), hn::Set(d, 0.5057293718554712f));
  r = hn::Add(hn::Mul(r, x), hn::Set(d, 1.0f));
  return hn::Div(r, hn::Add(hn::Mul(x, r), hn::Set(d, 1.0f)));
}

// Composites the blocks `mask` of pixel row y: a + (b - a) * w of two lines if kTwo, else a.
template <bool kTwo>
inline void CompositeRow(const float* paths, uint64_t mask, const Line& a, const Line& b, float w, int y,
                         TilePixels& tile) {
  const Pixels d;
  const auto one = hn::Set(d, 1.0f), opaque = hn::Set(d, kOpaque), weight = hn::Set(d, w);
  float* row = tile.at[y];
  for (uint64_t m = mask & ~tile.touched[y]; m != 0; m &= m - 1) {
    float* p = row + std::countr_zero(m) * kBlockFloats;
    for (int n = 0; n < 3 * kSplatBlock; n += int(hn::Lanes(d))) hn::Store(hn::Zero(d), d, p + n);
    for (int n = 3 * kSplatBlock; n < kBlockFloats; n += int(hn::Lanes(d))) hn::Store(one, d, p + n);
  }
  tile.touched[y] |= mask;
  uint64_t dead = 0;
  for (uint64_t m = mask; m != 0; m &= m - 1) {
    const int block = std::countr_zero(m);
    const float* pa = a.mask >> block & 1 ? a.at + block * kBlockFloats : kNothing;
    const float* pb = kTwo && (b.mask >> block & 1) ? b.at + block * kBlockFloats : kNothing;
    float* p = row + block * kBlockFloats;
    bool solid = true;
    for (int l = 0; l < kSplatBlock; l += int(hn::Lanes(d))) {
      const auto value = [&](int channel) HWY_ATTR {
        const auto va = hn::Load(d, pa + channel * kSplatBlock + l);
        if constexpr (!kTwo) return va;
        return hn::Add(va, hn::Mul(hn::Sub(hn::Load(d, pb + channel * kSplatBlock + l), va), weight));
      };
      const auto at = hn::Iota(d, float(l));
      const float* polynomial = paths + 3 * block;
      const auto slope = hn::Add(hn::Set(d, polynomial[1]), hn::Mul(hn::Set(d, polynomial[2]), at));
      const auto path = hn::Add(hn::Set(d, polynomial[0]), hn::Mul(slope, at));
      const auto x = hn::Mul(hn::Max(value(3), hn::Zero(d)), path);
      const auto attenuation = Attenuation(x);
      const auto light = hn::Load(d, p + 3 * kSplatBlock + l);
      const auto part = hn::Mul(hn::Mul(light, path), attenuation);
      const auto left = hn::Mul(light, hn::Sub(one, hn::Mul(x, attenuation)));
      for (int channel = 0; channel < 3; ++channel) {
        float* q = p + channel * kSplatBlock + l;
        hn::Store(hn::Add(hn::Load(d, q), hn::Mul(value(channel), part)), d, q);
      }
      hn::Store(left, d, p + 3 * kSplatBlock + l);
      solid = solid && hn::AllTrue(d, hn::Lt(left, opaque));
    }
    dead |= uint64_t{solid} << block;
  }
  tile.live[y] &= ~dead;
}

// Writes a layer's pixels, and reduces the remaining light by the layer's opacity.
inline void FinishLayer(const SplatScene& scene, const SplatTile& job, const TilePixels& tile, SplatOutcome& out) {
  const Pixels d;
  const hn::RebindToSigned<Pixels> di;
  const auto one = hn::Set(d, 1.0f), scale = hn::Set(d, 255.0f), half = hn::Set(d, 0.5f);
  for (int y = 0; y < job.rows; ++y) {
    for (uint64_t m = tile.touched[y]; m != 0; m &= m - 1) {
      const int block = std::countr_zero(m), x = job.x0 + block * kSplatBlock, at_y = job.y0 + y;
      if (at_y < job.image_y || at_y >= job.image_y + job.image_height || x < job.image_x ||
          x >= job.image_x + job.image_width)
        continue;  // reached by rounding alone
      const float* p = tile.at[y] + block * kBlockFloats;
      float* remaining = job.remaining + size_t(at_y) * size_t(scene.blocks_across * kSplatBlock) + x;
      const bool fresh = !(job.begun[y] >> block & 1);
      alignas(32) uint32_t pixels[kSplatBlock];
      uint32_t opaque = 0, seen = 0;
      for (int l = 0; l < kSplatBlock; l += int(hn::Lanes(d))) {
        const auto left = hn::Load(d, p + 3 * kSplatBlock + l);
        // Only by rounding do colours exceed alpha.
        const auto alpha = hn::Min(hn::Sub(one, left), one);
        const auto a = hn::ConvertTo(di, hn::Add(hn::Mul(alpha, scale), half));
        const auto channel = [&](int c) HWY_ATTR {
          return hn::ConvertTo(di, hn::Add(hn::Mul(hn::Min(hn::Load(d, p + c * kSplatBlock + l), alpha), scale), half));
        };
        const auto colour = hn::Or(hn::Or(hn::ShiftLeft<24>(a), hn::ShiftLeft<16>(channel(0))),
                                   hn::Or(hn::ShiftLeft<8>(channel(1)), channel(2)));
        hn::Store(colour, di, reinterpret_cast<int32_t*>(pixels) + l);
        const auto before = fresh ? one : hn::Load(d, remaining + l);
        alignas(32) float earlier[kSplatBlock];
        hn::Store(before, d, earlier);
        const auto now = hn::Mul(before, left);
        hn::Store(now, d, remaining + l);
        job.begun[y] |= uint64_t{1} << block;
        for (int n = 0; n < int(hn::Lanes(d)); ++n) {
          // Made opaque by this layer, alone or as the last one: a margin that earlier ones lost must not come back.
          opaque |=
              uint32_t{remaining[l + n] < kOpaque && (earlier[n] >= kOpaque || p[3 * kSplatBlock + l + n] < kOpaque)}
              << (l + n);
          seen |= uint32_t{pixels[l + n] != 0} << (l + n);
        }
      }
      const size_t index = size_t(at_y) * size_t(scene.blocks_across) + size_t(x / kSplatBlock);
      job.opaque[index] = uint8_t(job.opaque[index] | opaque);
      if (seen == 0) continue;
      out.x_lo = std::min(out.x_lo, x + std::countr_zero(seen));
      out.x_hi = std::max(out.x_hi, x + 31 - std::countl_zero(seen));
      out.y_lo = std::min(out.y_lo, at_y), out.y_hi = std::max(out.y_hi, at_y);
      uint32_t* to = job.image + std::ptrdiff_t(at_y - job.image_y) * job.image_width + (x - job.image_x);
      const int count = std::min(kSplatBlock, job.image_x + job.image_width - x);
      std::copy_n(pixels, count, to);
    }
  }
}

}  // namespace telesplat::sampler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
