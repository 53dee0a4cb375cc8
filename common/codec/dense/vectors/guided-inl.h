// Guided prediction with vectors: products of 16 bits, two at a time, which halves their number. Included once for
// every instruction set, in its namespace. No include guard: that is meant.

#if HWY_TARGET <= HWY_AVX2

// Pairs of terms whose products are added at once. What is to the left comes last, in place of kFarAbove where weights
// are the same for all pixels; and where that is not known yet, the plane's own residuals.
constexpr int kPairs = 8;
constexpr int kTermPairs[kPairs][2] = {{1, 2},  {3, 4},   {5, 6},          {7, 8},
                                       {9, 10}, {11, 12}, {13, kFarAbove}, {0, kFarLeft}};
using D16 = hn::CappedTag<int16_t, 32>;
using D32 = hn::Repartition<int32_t, D16>;
using V16 = hn::VFromD<D16>;
using V32 = hn::VFromD<D32>;
constexpr D16 kD16s;
constexpr D32 kD32s;

// Of each block of eight pixels the first and the last four.
struct PairSums {
  V32 low, high;
};

HWY_INLINE V32 PairProducts(V16 pairs, V32 weights) {
#if HWY_TARGET <= HWY_AVX3
  return V32{_mm512_madd_epi16(pairs.raw, weights.raw)};
#else
  return V32{_mm256_madd_epi16(pairs.raw, weights.raw)};
#endif
}

HWY_INLINE V32 AddProducts(V32 sum, V16 pairs, V32 weights) { return hn::Add(sum, PairProducts(pairs, weights)); }

// Pixels in their order.
HWY_INLINE void StorePairs(const PairSums& sums, int32_t* out) {
  const V32 low = sums.low, high = sums.high;
#if HWY_TARGET <= HWY_AVX3
  const __m512i first = _mm512_set_epi64(11, 10, 3, 2, 9, 8, 1, 0), last = _mm512_set_epi64(15, 14, 7, 6, 13, 12, 5, 4);
  hn::StoreU(V32{_mm512_permutex2var_epi64(low.raw, first, high.raw)}, kD32s, out);
  hn::StoreU(V32{_mm512_permutex2var_epi64(low.raw, last, high.raw)}, kD32s, out + 16);
#else
  hn::StoreU(V32{_mm256_permute2x128_si256(low.raw, high.raw, 0x20)}, kD32s, out);
  hn::StoreU(V32{_mm256_permute2x128_si256(low.raw, high.raw, 0x31)}, kD32s, out + 8);
#endif
}

// The same as 16 bits; what does not fit becomes the nearest number that does.
HWY_INLINE V16 Joined(const PairSums& sums) {
#if HWY_TARGET <= HWY_AVX3
  return V16{_mm512_packs_epi32(sums.low.raw, sums.high.raw)};
#else
  return V16{_mm256_packs_epi32(sums.low.raw, sums.high.raw)};
#endif
}

HWY_INLINE int32_t PairOf(int16_t first, int16_t second) {
  return static_cast<int32_t>(static_cast<uint16_t>(first) | static_cast<uint32_t>(static_cast<uint16_t>(second))
                                                                 << 16);
}

// Sums where all pixels have the same weights. with_left: what is to the left counts.
class EvenTerms {
 public:
  EvenTerms(const GuidedRows& rows, int32_t constant, bool with_left)
      : up_(rows.above),
        guide_{rows.guide[0], rows.guide[1], rows.guide[2]},
        residual_(rows.residual != nullptr ? rows.residual : rows.above),
        last_(with_left                      ? rows.own - 1
              : rows.own_residual != nullptr ? rows.own_residual
                                             : rows.above),
        has_last_(rows.residual != nullptr || rows.own_residual != nullptr || with_left),
        constant_(hn::Set(kD32s, constant)) {
    const int16_t* const w = rows.weights[0];
    for (int i = 0; i < kLast; ++i) weights_[i] = hn::Set(kD32s, PairOf(w[kTermPairs[i][0]], w[kTermPairs[i][1]]));
    weights_[kLast] = hn::Set(kD32s, PairOf(rows.residual != nullptr ? w[kOtherResidual] : int16_t{0},
                                            with_left                      ? w[0]
                                            : rows.own_residual != nullptr ? int16_t{kOwnWeight}
                                                                           : int16_t{0}));
  }
  HWY_INLINE PairSums At(size_t x) const {
    PairSums sums{constant_, constant_};
    const int16_t *const up = up_ + x, *const g0 = guide_[0] + x, *const g1 = guide_[1] + x, *const g2 = guide_[2] + x;
    Add(sums, up, up - 1, weights_[0]), Add(sums, up + 1, g0 - 1, weights_[1]), Add(sums, g0, g0 + 1, weights_[2]);
    Add(sums, g1 - 1, g1, weights_[3]), Add(sums, g1 + 1, g2 - 1, weights_[4]), Add(sums, g2, g2 + 1, weights_[5]);
    if (has_last_) Add(sums, residual_ + x, last_ + x, weights_[kLast]);
    return sums;
  }

 private:
  static constexpr int kLast = 6;
  static HWY_INLINE void Add(PairSums& sums, const int16_t* first, const int16_t* second, V32 weights) {
    const V16 a = hn::LoadU(kD16s, first), b = hn::LoadU(kD16s, second);
    sums.low = AddProducts(sums.low, hn::InterleaveLower(kD16s, a, b), weights);
    sums.high = AddProducts(sums.high, hn::InterleaveUpper(kD16s, a, b), weights);
  }
  const int16_t *const up_, *const guide_[3], *const residual_, *const last_;
  const bool has_last_;
  const V32 constant_;
  V32 weights_[kLast + 1];
};

// Sums where each flatness has weights of its own.
class FlatTerms {
 public:
  FlatTerms(const GuidedRows& rows, int32_t constant, bool with_left)
      : terms_{rows.own_residual != nullptr ? rows.own_residual : rows.own - 1,
               rows.above,
               rows.above - 1,
               rows.above + 1,
               rows.guide[0] - 1,
               rows.guide[0],
               rows.guide[0] + 1,
               rows.guide[1] - 1,
               rows.guide[1],
               rows.guide[1] + 1,
               rows.guide[2] - 1,
               rows.guide[2],
               rows.guide[2] + 1,
               rows.residual != nullptr ? rows.residual : rows.above,
               rows.own - 2,
               rows.above2},
        flatness_(rows.flatness),
        has_last_(with_left || rows.own_residual != nullptr),
        constant_(hn::Set(kD32s, constant)) {
    HWY_UNROLL(8) for (int pair = 0; pair < kPairs; ++pair) {
      HWY_ALIGN int32_t of[kFlatnesses];
      for (int k = 0; k < kFlatnesses; ++k) {
        const int16_t* const w = rows.weights[k];
        of[k] = PairOf(w[kTermPairs[pair][0]], w[kTermPairs[pair][1]]);
        if (pair == 6 && rows.residual == nullptr) of[k] &= ~0xFFFF;
        if (pair == 7 && rows.own_residual != nullptr) of[k] = kOwnWeight;
      }
      weights_[pair] = OfEach(of);
    }
  }
  HWY_INLINE PairSums At(size_t x) const {
    const hn::Rebind<uint8_t, D16> bytes;
    const hn::RebindToUnsigned<D16> words;
    const V16 flat = hn::BitCast(kD16s, hn::PromoteTo(words, hn::LoadU(bytes, flatness_ + x)));
    const V32 flat_low = hn::BitCast(kD32s, hn::InterleaveLower(kD16s, flat, hn::Zero(kD16s))),
              flat_high = hn::BitCast(kD32s, hn::InterleaveUpper(kD16s, flat, hn::Zero(kD16s)));
    PairSums sums{constant_, constant_};
    const auto add = [&](int pair) HWY_ATTR {
      const V16 a = hn::LoadU(kD16s, terms_[kTermPairs[pair][0]] + x),
                b = hn::LoadU(kD16s, terms_[kTermPairs[pair][1]] + x);
      sums.low = AddProducts(sums.low, hn::InterleaveLower(kD16s, a, b), ByFlatness(weights_[pair], flat_low));
      sums.high = AddProducts(sums.high, hn::InterleaveUpper(kD16s, a, b), ByFlatness(weights_[pair], flat_high));
    };
    HWY_UNROLL(8) for (int pair = 0; pair < kPairs - 1; ++pair) add(pair);
    if (has_last_) add(kPairs - 1);
    return sums;
  }

 private:
  // All eight, as often as they fit.
  static HWY_INLINE V32 OfEach(const int32_t* eight) {
    const __m256i of = _mm256_load_si256(reinterpret_cast<const __m256i*>(eight));
#if HWY_TARGET <= HWY_AVX3
    return V32{_mm512_broadcast_i64x4(of)};
#else
    return V32{of};
#endif
  }
  // The weights of each pixel's flatness: those at `at` of eight.
  static HWY_INLINE V32 ByFlatness(V32 weights, V32 at) {
#if HWY_TARGET <= HWY_AVX3
    return V32{_mm512_permutexvar_epi32(at.raw, weights.raw)};
#else
    return V32{_mm256_permutevar8x32_epi32(weights.raw, at.raw)};
#endif
  }
  const int16_t* const terms_[kGuidedTerms];
  const uint8_t* const flatness_;
  const bool has_last_;
  const V32 constant_;
  V32 weights_[kPairs];
};

template <class Terms>
HWY_INLINE void SumsOfTerms(const Terms& terms, size_t n, int32_t* HWY_RESTRICT sums) {
  for (size_t x = 0; x < n; x += hn::Lanes(kD16s)) StorePairs(terms.At(x), sums + x);
}

// As GuidedSums().
static void PairedSums(const GuidedRows& rows, size_t n, int32_t* HWY_RESTRICT sums, bool with_left) {
  if (rows.flatness != nullptr)
    SumsOfTerms(FlatTerms(rows, rows.constant, with_left), n, sums);
  else
    SumsOfTerms(EvenTerms(rows, rows.constant, false), n, sums);
}

HWY_INLINE V16 NearestOf(PairSums sums, int bits, V16 most) {
  sums.low = hn::ShiftRightSame(sums.low, bits + 13), sums.high = hn::ShiftRightSame(sums.high, bits + 13);
  return hn::Min(hn::Max(Joined(sums), hn::Zero(kD16s)), most);
}

HWY_INLINE V16 Folded16(V16 v) { return hn::Xor(hn::Add(v, v), hn::ShiftRight<15>(v)); }

// Numbers below 256 and their tokens, as ByteToken(), of as many pixels as two vectors have.
class ByteTokens {
 public:
#if HWY_TARGET <= HWY_AVX3_DL
  ByteTokens() : tokens_(kTokens.data()), low_bytes_(_mm512_load_si512(kLowBytes.data())) {}
  HWY_INLINE void Store(V16 a, V16 b, uint8_t* z, uint8_t* tokens) const {
    const VBytes bytes{_mm512_permutex2var_epi8(a.raw, low_bytes_, b.raw)};
    hn::StoreU(bytes, kDBytes, z);
    hn::StoreU(tokens_(bytes), kDBytes, tokens);
  }

 private:
  static constexpr auto kTokens = [] {
    std::array<uint8_t, 256> of{};
    for (unsigned z = 0; z < of.size(); ++z) of[z] = ByteToken(static_cast<uint8_t>(z));
    return of;
  }();
  HWY_ALIGN static constexpr auto kLowBytes = [] {
    std::array<uint8_t, 64> of{};
    for (size_t i = 0; i < of.size(); ++i) of[i] = static_cast<uint8_t>(2 * i);
    return of;
  }();
  const ByteTable tokens_;
  const __m512i low_bytes_;
#else
  HWY_INLINE void Store(V16 a, V16 b, uint8_t* z, uint8_t* tokens) const {
    StoreOne(a, z, tokens), StoreOne(b, z + hn::Lanes(kD16s), tokens + hn::Lanes(kD16s));
  }

 private:
  static HWY_INLINE void StoreOne(V16 folded, uint8_t* z, uint8_t* tokens) {
    const hn::Rebind<uint8_t, D16> bytes;
    const V16 eight = hn::Set(kD16s, int16_t{8}), v = hn::Add(folded, eight);
    V16 token = hn::Min(folded, hn::ShiftRight<1>(v)), add = eight;
    token = hn::Min(token, hn::Add(hn::ShiftRight<2>(v), add)), add = hn::Add(add, eight);
    token = hn::Min(token, hn::Add(hn::ShiftRight<3>(v), add)), add = hn::Add(add, eight);
    token = hn::Min(token, hn::Add(hn::ShiftRight<4>(v), add)), add = hn::Add(add, eight);
    token = hn::Min(token, hn::Add(hn::ShiftRight<5>(v), add));
    hn::StoreU(hn::DemoteTo(bytes, folded), bytes, z);
    hn::StoreU(hn::DemoteTo(bytes, token), bytes, tokens);
  }
#endif
};

template <class Terms>
HWY_INLINE void ByteResiduals(const Terms& terms, const GuidedRows& rows, size_t n, uint8_t* HWY_RESTRICT z,
                              uint8_t* HWY_RESTRICT tokens, int16_t* HWY_RESTRICT residual) {
  const ByteTokens byte_tokens;
  const V16 most = hn::Set(kD16s, static_cast<int16_t>(rows.most));
  const auto folded_at = [&](size_t x) HWY_ATTR {
    const V16 guess = NearestOf(terms.At(x), 6, most);
    const V16 off = hn::Sub(hn::ShiftRight<6>(hn::LoadU(kD16s, rows.own + x)), guess);
    const V16 r = hn::ShiftRight<8>(hn::ShiftLeft<8>(off));
    hn::StoreU(hn::ShiftLeft<6>(r), kD16s, residual + x);
    return Folded16(r);
  };
  for (size_t x = 0; x < n; x += 2 * hn::Lanes(kD16s)) {
    const V16 first = folded_at(x), second = folded_at(x + hn::Lanes(kD16s));
    byte_tokens.Store(first, second, z + x, tokens + x);
  }
}

// As GuidedResiduals().
static void PairedResiduals(const GuidedRows& rows, size_t n, uint8_t* z, uint8_t* tokens, int16_t* residual) {
  const int32_t constant = rows.constant + (1 << 18);
  if (rows.flatness != nullptr)
    ByteResiduals(FlatTerms(rows, constant, true), rows, n, z, tokens, residual);
  else
    ByteResiduals(EvenTerms(rows, constant, true), rows, n, z, tokens, residual);
}

// As GuidedResidualsWide(): of values below 2^11, so that what is left has 12 bits.
static void PairedResidualsWide(const GuidedRows& rows, size_t n, uint32_t* HWY_RESTRICT z,
                                uint8_t* HWY_RESTRICT tokens, int16_t* HWY_RESTRICT residual) {
  const int bits = rows.bits;
  const EvenTerms terms(rows, rows.constant + (1 << (bits + 12)), true);
  const V16 most = hn::Set(kD16s, static_cast<int16_t>(rows.most));
  const hn::Half<D16> half;
  const hn::Rebind<float, hn::Half<D16>> floats;
  const auto store = [&](hn::VFromD<hn::Half<D16>> v, size_t x) HWY_ATTR {
    const auto folded = hn::PromoteTo(kD32s, v);
    hn::StoreU(hn::BitCast(kD, folded), kD, z + x);
    const auto exponent = hn::BitCast(kD, hn::ConvertTo(floats, hn::Add(folded, hn::Set(kD32s, 8))));
    hn::StoreU(LowBytes(hn::Sub(hn::ShiftRight<20>(exponent), hn::Set(kD, 1040u))), kD8, tokens + x);
  };
  for (size_t x = 0; x < n; x += hn::Lanes(kD16s)) {
    const V16 r = hn::Sub(hn::ShiftRightSame(hn::LoadU(kD16s, rows.own + x), bits), NearestOf(terms.At(x), bits, most));
    hn::StoreU(hn::ShiftLeftSame(r, bits), kD16s, residual + x);
    const V16 folded = Folded16(r);
    store(hn::LowerHalf(half, folded), x), store(hn::UpperHalf(half, folded), x + hn::Lanes(half));
  }
}

#else
constexpr SumsOf PairedSums = GuidedSums;
constexpr auto PairedResiduals = GuidedResiduals<GuidedSums>;
constexpr auto PairedResidualsWide = GuidedResidualsWide<GuidedSums>;
#endif
