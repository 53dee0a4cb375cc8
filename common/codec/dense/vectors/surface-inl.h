// What depth says of surfaces, with vectors of 16 bits: directions of normals, heights, activity. Included once for
// every instruction set, in its namespace. No include guard: that is meant.

#if HWY_TARGET <= HWY_AVX2

using U16 = hn::RebindToUnsigned<D16>;
using VU16 = hn::VFromD<U16>;
constexpr U16 kU16;
using DU32 = hn::RebindToUnsigned<D32>;
constexpr DU32 kDU32;
constexpr size_t kHalf = hn::MaxLanes(D32());  // pixels of half a vector of 16 bits

// Two vectors as one of 16 bits, in blocks of four pixels that InOrder() puts into their order; what does not fit
// becomes the nearest number that does.
HWY_INLINE V16 Packed(V32 a, V32 b) { return Joined(PairSums{a, b}); }

HWY_INLINE V16 InOrder(V16 v) {
#if HWY_TARGET <= HWY_AVX3
  return V16{_mm512_permutexvar_epi64(_mm512_set_epi64(7, 5, 3, 1, 6, 4, 2, 0), v.raw)};
#else
  return V16{_mm256_permute4x64_epi64(v.raw, 0xD8)};
#endif
}

// 2^29 / d, about, for 2^14 <= d < 2^15: below 2^15. Newton's method, as in Geometry().
HWY_INLINE VU16 Reciprocals(VU16 d) {
  const VU16 half = hn::Set(kU16, uint16_t{32768}), twice = hn::Add(d, d);
  VU16 r = hn::Sub(hn::Set(kU16, uint16_t{46260}), hn::MulHigh(d, hn::Set(kU16, uint16_t{2 * 30840})));
  for (int round = 0; round < 2; ++round) {
    const VU16 rest = hn::Sub(half, hn::MulHigh(twice, r));
    r = hn::MulHigh(hn::Add(r, r), hn::Add(rest, rest));
  }
  return r;
}

// By how many bits v, 1 to 2^24, must be shifted so that its highest bit becomes bit `bit`.
HWY_INLINE hn::VFromD<DU32> ShiftTo(int bit, V32 v) {
  const hn::Rebind<float, D32> floats;
  const auto exponent = hn::ShiftRight<23>(hn::BitCast(kDU32, hn::ConvertTo(floats, v)));
  return hn::Sub(hn::Set(kDU32, static_cast<uint32_t>(bit + 127)), exponent);
}

HWY_INLINE V32 ShiftUp(V32 v, hn::VFromD<DU32> by) { return hn::BitCast(kD32s, hn::Shl(hn::BitCast(kDU32, v), by)); }

HWY_INLINE V32 Clamped16(V32 v) { return hn::Min(hn::Max(v, hn::Set(kD32s, -32767)), hn::Set(kD32s, 32767)); }

// The upper halves of both, which InOrderOfWords() puts into the order of pixels.
HWY_INLINE V16 UpperWords(V32 a, V32 b) {
#if HWY_TARGET <= HWY_AVX3
  HWY_ALIGN static constexpr auto kUpper = [] {
    std::array<uint16_t, 32> of{};
    for (size_t i = 0; i < of.size(); ++i) of[i] = static_cast<uint16_t>(2 * i + 1);
    return of;
  }();
  return V16{_mm512_permutex2var_epi16(a.raw, _mm512_load_si512(kUpper.data()), b.raw)};
#else
  return Packed(hn::ShiftRight<16>(a), hn::ShiftRight<16>(b));
#endif
}

HWY_INLINE V16 InOrderOfWords(V16 v) {
#if HWY_TARGET <= HWY_AVX3
  return v;
#else
  return InOrder(v);
#endif
}

// As Geometry().
class GeometryVectors {
 public:
  GeometryVectors(const uint32_t* const depth[3], int x0, int y, const GeometryModel& model)
      : above_(depth[0]),
        here_(depth[1]),
        below_(depth[2]),
        slope_shift_(model.slope_shift),
        height_shift_(model.height_shift),
        first_(hn::BitCast(kD16s, hn::Or(hn::And(hn::Add(hn::Iota(kD32s, 0), hn::Set(kD32s, x0)), LowWords()),
                                         hn::Set(kD32s, PairOf(0, static_cast<int16_t>(y)))))) {
    for (int i = 0; i < 3; ++i) {
      by_slopes_[i] = hn::Set(kD32s, PairOf(model.matrix[i][0], model.matrix[i][1]));
      by_height_[i] = hn::Set(kD32s, PairOf(model.matrix[i][2], 0));
    }
  }
  HWY_INLINE void Run(size_t n, int16_t* HWY_RESTRICT gx, int16_t* HWY_RESTRICT gy) const {
    const V16 end = hn::Set(kD16s, int16_t{8128});
    for (size_t x = 0; x < n; x += 2 * kHalf) {
      const Direction a = At(x), b = At(x + kHalf);
      const V16 divisor = hn::Or(UpperWords(a.size, b.size), hn::Set(kD16s, int16_t{0x4000}));
      const V16 z = UpperWords(a.z, b.z);
      const V16 r = hn::BitCast(kD16s, Reciprocals(hn::BitCast(kU16, divisor)));
      const V16 qx = Quotient(UpperWords(a.x, b.x), r), qy = Quotient(UpperWords(a.y, b.y), r);
      const V16 fx = WithSign(hn::Sub(end, hn::Abs(qy)), qx), fy = WithSign(hn::Sub(end, hn::Abs(qx)), qy);
      const auto behind = hn::Lt(z, hn::Zero(kD16s));
      hn::StoreU(InOrderOfWords(hn::Add(hn::IfThenElse(behind, fx, qx), end)), kD16s, gx + x);
      hn::StoreU(InOrderOfWords(hn::Add(hn::IfThenElse(behind, fy, qy), end)), kD16s, gy + x);
    }
  }

 private:
  struct Direction {
    V32 x, y, z, size;  // shifted up, but for z, of which only the sign counts
  };
  static HWY_INLINE V32 LowWords() { return hn::Set(kD32s, 0xFFFF); }
  // Both as 16 bits, in pairs.
  static HWY_INLINE V16 Slopes(V32 u, V32 v) {
    HWY_ALIGN static constexpr uint8_t kPairBytes[16] = {0, 1, 8, 9, 2, 3, 10, 11, 4, 5, 12, 13, 6, 7, 14, 15};
    const hn::Repartition<uint8_t, D16> bytes;
    const V16 both = hn::Max(Joined(PairSums{u, v}), hn::Set(kD16s, int16_t{-32767}));
    return hn::BitCast(kD16s, hn::TableLookupBytes(both, hn::LoadDup128(bytes, kPairBytes)));
  }
  HWY_INLINE Direction At(size_t x) const {
    const auto load = [](const uint32_t* from) HWY_ATTR { return hn::BitCast(kD32s, hn::LoadU(kDU32, from)); };
    const auto slope = [&](V32 v) HWY_ATTR { return hn::ShiftRightSame(v, slope_shift_); };
    const V16 uv = Slopes(slope(hn::Sub(load(here_ + x + 1), load(here_ + x - 1))),
                          slope(hn::Sub(load(below_ + x), load(above_ + x))));
    const V16 place = hn::Add(first_, hn::BitCast(kD16s, hn::Set(kD32s, static_cast<int32_t>(x & 0xFFFF))));
    const V32 twice = slope(hn::ShiftLeft<1>(load(here_ + x)));
    const V32 height = hn::Sub(twice, PairProducts(uv, hn::BitCast(kD32s, place)));
    const V16 h = hn::BitCast(kD16s, Clamped16(hn::ShiftRightSame(height, height_shift_)));
    V32 m[3];
    for (int i = 0; i < 3; ++i) m[i] = AddProducts(PairProducts(uv, by_slopes_[i]), h, by_height_[i]);
    const V32 size = hn::Add(hn::Add(hn::Abs(m[0]), hn::Abs(m[1])), hn::Abs(m[2]));
    const auto up = ShiftTo(24, hn::Or(hn::ShiftRight<6>(size), hn::Set(kD32s, 1)));
    return {ShiftUp(m[0], up), ShiftUp(m[1], up), m[2], ShiftUp(size, up)};
  }
  // (n * r >> 15) * 127 >> 8.
  static HWY_INLINE V16 Quotient(V16 n, V16 r) {
    const V16 high = hn::MulHigh(n, r);
    const V16 top = hn::BitCast(kD16s, hn::ShiftRight<15>(hn::BitCast(kU16, hn::Mul(n, r))));
    return hn::MulHigh(hn::Or(hn::Add(high, high), top), hn::Set(kD16s, int16_t{127 * 256}));
  }
  static HWY_INLINE V16 WithSign(V16 v, V16 by) {
    const V16 negative = hn::ShiftRight<15>(by);
    return hn::Sub(hn::Xor(v, negative), negative);
  }

  const uint32_t *const above_, *const here_, *const below_;
  const int slope_shift_, height_shift_;
  const V16 first_;  // x and y, in pairs
  V32 by_slopes_[3], by_height_[3];
};

static void ShortGeometry(const uint32_t* const depth[3], size_t n, int x0, int y, const GeometryModel& model,
                          int16_t* gx, int16_t* gy) {
  GeometryVectors(depth, x0, y, model).Run(n, gx, gy);
}

// As Heights().
class HeightVectors {
 public:
  HeightVectors(const uint32_t* depth, int x0, int y, const HeightModel& model)
      : depth_(depth),
        base_(hn::Set(kDU32, static_cast<uint32_t>(model.base))),
        first_(hn::Add(
            hn::Mul(hn::Iota(kDU32, 0), hn::Set(kDU32, static_cast<uint32_t>(model.a))),
            hn::Set(kDU32, static_cast<uint32_t>(model.b) * static_cast<uint32_t>(y) + static_cast<uint32_t>(model.c) +
                               static_cast<uint32_t>(model.a) * static_cast<uint32_t>(x0)))),
        a_(static_cast<uint32_t>(model.a)),
        low_(hn::Set(kD16s, static_cast<int16_t>(model.low))),
        scale_(hn::Set(kU16, static_cast<uint16_t>(model.scale))) {}
  HWY_INLINE void Run(size_t n, int16_t* HWY_RESTRICT out) const {
    for (size_t x = 0; x < n; x += 2 * kHalf) {
      const Ratio a = At(x), b = At(x + kHalf);
      const VU16 r = Reciprocals(hn::BitCast(kU16, Packed(a.divisor, b.divisor)));
      const V16 negative = Packed(a.negative, b.negative);
      const V16 quotient = hn::BitCast(kD16s, hn::MulHigh(Unsigned(a.size, b.size), r));
      const V16 height = hn::Sub(hn::Xor(quotient, negative), negative);
      const VU16 off = hn::BitCast(kU16, hn::Max(hn::SaturatedSub(height, low_), hn::Zero(kD16s)));
      // off * scale >> 12, or what is just too large.
      const VU16 high = hn::Min(hn::MulHigh(off, scale_), hn::Set(kU16, uint16_t{1024}));
      const VU16 at = hn::Or(hn::ShiftLeft<4>(high), hn::ShiftRight<12>(hn::Mul(off, scale_)));
      hn::StoreU(InOrder(hn::BitCast(kD16s, hn::Min(at, hn::Set(kU16, uint16_t{16383})))), kD16s, out + x);
    }
  }

 private:
  struct Ratio {
    V32 size, negative, divisor;
  };
  HWY_INLINE Ratio At(size_t x) const {
    const auto code = hn::And(hn::LoadU(kDU32, depth_ + x), hn::Set(kDU32, 0xFFFFFFu));
    const auto terms = hn::Add(first_, hn::Set(kDU32, a_ * static_cast<uint32_t>(x)));
    const V32 sum = hn::BitCast(kD32s, hn::Sub(terms, hn::Mul(code, base_)));
    const V32 negative = hn::ShiftRight<31>(sum), whole = hn::BitCast(kD32s, code);
    const V32 size = hn::Min(hn::Xor(sum, negative), whole);
    const auto up = ShiftTo(23, hn::Or(whole, hn::Set(kD32s, 1)));
    return {hn::ShiftRight<8>(ShiftUp(size, up)), negative,
            hn::Or(hn::ShiftRight<9>(ShiftUp(whole, up)), hn::Set(kD32s, 0x4000))};
  }
  // As Packed(), of numbers below 2^16.
  static HWY_INLINE VU16 Unsigned(V32 a, V32 b) {
#if HWY_TARGET <= HWY_AVX3
    return VU16{_mm512_packus_epi32(a.raw, b.raw)};
#else
    return VU16{_mm256_packus_epi32(a.raw, b.raw)};
#endif
  }

  const uint32_t* const depth_;
  const hn::VFromD<DU32> base_, first_;
  const uint32_t a_;
  const V16 low_;
  const VU16 scale_;
};

static void ShortHeights(const uint32_t* depth, size_t n, int x0, int y, const HeightModel& model, int16_t* out) {
  HeightVectors(depth, x0, y, model).Run(n, out);
}

// As Activity().
static void ShortActivity(const int16_t* const gx[3], const int16_t* const gy[3], size_t n,
                          uint8_t* HWY_RESTRICT tokens) {
  const hn::Half<U16> half;
  const hn::Rebind<float, D32> floats;
  for (size_t x = 0; x < n; x += 2 * kHalf) {
    const auto apart = [&](const int16_t* a, const int16_t* b) HWY_ATTR {
      return hn::BitCast(kU16, hn::Abs(hn::Sub(hn::LoadU(kD16s, a + x), hn::LoadU(kD16s, b + x))));
    };
    const VU16 sum = hn::Add(hn::Add(apart(gx[1] + 1, gx[1] - 1), apart(gx[2], gx[0])),
                             hn::Add(apart(gy[1] + 1, gy[1] - 1), apart(gy[2], gy[0])));
    const VU16 v = hn::Add(hn::ShiftRight<3>(sum), hn::Set(kU16, uint16_t{8}));
    const auto store = [&](hn::VFromD<hn::Half<U16>> part, size_t at) HWY_ATTR {
      const auto number = hn::ConvertTo(floats, hn::BitCast(kD32s, hn::PromoteTo(kDU32, part)));
      const auto token = hn::Sub(hn::ShiftRight<20>(hn::BitCast(kDU32, number)), hn::Set(kDU32, 1040u));
      hn::StoreU(LowBytes(token), kD8, tokens + at);
    };
    store(hn::LowerHalf(half, v), x), store(hn::UpperHalf(half, v), x + kHalf);
  }
}

#else
constexpr auto ShortActivity = Activity;
constexpr auto ShortGeometry = Geometry;
constexpr auto ShortHeights = Heights;
#endif
