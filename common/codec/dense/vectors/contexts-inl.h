// Contexts of tokens with vectors: by products of bytes, two at a time, and by tables. Included once for every
// instruction set, in its namespace. No include guard: that is meant.

using DBytes = hn::CappedTag<uint8_t, 64>;
using VBytes = hn::VFromD<DBytes>;
constexpr DBytes kDBytes;

// table[i] of 256.
class ByteTable {
 public:
#if HWY_TARGET <= HWY_AVX3_DL
  explicit ByteTable(const uint8_t* table) {
    for (int i = 0; i < 4; ++i) quarters_[i] = _mm512_loadu_si512(table + 64 * i);
  }
  HWY_INLINE VBytes operator()(VBytes i) const {
    const __m512i lower = _mm512_permutex2var_epi8(quarters_[0], i.raw, quarters_[1]),
                  upper = _mm512_permutex2var_epi8(quarters_[2], i.raw, quarters_[3]);
    return VBytes{_mm512_mask_mov_epi8(lower, _mm512_movepi8_mask(i.raw), upper)};
  }

 private:
  __m512i quarters_[4];
#else
  explicit ByteTable(const uint8_t* table) : table_(table) {}
  HWY_INLINE VBytes operator()(VBytes i) const {
    const hn::Repartition<uint16_t, DBytes> words;
    const VBytes low = hn::Set(kDBytes, uint8_t{15}), column = hn::And(i, low),
                 row = hn::And(hn::BitCast(kDBytes, hn::ShiftRight<4>(hn::BitCast(words, i))), low);
    VBytes out = hn::Zero(kDBytes);
    HWY_UNROLL(16) for (int k = 0; k < 16; ++k) {
      const VBytes of_row = hn::TableLookupBytes(hn::LoadDup128(kDBytes, table_ + 16 * k), column);
      out = hn::IfThenElse(hn::Eq(row, hn::Set(kDBytes, static_cast<uint8_t>(k))), of_row, out);
    }
    return out;
  }

 private:
  const uint8_t* table_;
#endif
};

// As PlaneContexts(). Kinds are below 16.
static void PlaneContextsVector(const uint8_t* HWY_RESTRICT above, size_t n, int merges,
                                uint8_t* HWY_RESTRICT contexts) {
  const hn::Repartition<uint16_t, DBytes> words;
  const ByteTable table(kPlaneContexts.data());
  const VBytes most = hn::Set(kDBytes, static_cast<uint8_t>(15 >> merges));
  for (size_t x = 0; x < n; x += hn::Lanes(kDBytes)) {
    const auto here = hn::BitCast(words, hn::LoadU(kDBytes, above + x));
    const VBytes pair = hn::Or(hn::BitCast(kDBytes, hn::ShiftLeft<4>(here)), hn::LoadU(kDBytes, above + x + 1));
    const auto merged = hn::ShiftRightSame(hn::BitCast(words, table(pair)), merges);
    hn::StoreU(hn::And(hn::BitCast(kDBytes, merged), most), kDBytes, contexts + x);
  }
}

#if HWY_TARGET <= HWY_AVX2

using DSums = hn::Repartition<int16_t, DBytes>;
using VSums = hn::VFromD<DSums>;
constexpr DSums kDSums;

HWY_INLINE VSums BytePairs(VBytes pairs, VSums weights) {
#if HWY_TARGET <= HWY_AVX3
  return VSums{_mm512_maddubs_epi16(pairs.raw, weights.raw)};
#else
  return VSums{_mm256_maddubs_epi16(pairs.raw, weights.raw)};
#endif
}

HWY_INLINE VBytes Joined(VSums low, VSums high) {
#if HWY_TARGET <= HWY_AVX3
  return VBytes{_mm512_packus_epi16(low.raw, high.raw)};
#else
  return VBytes{_mm256_packus_epi16(low.raw, high.raw)};
#endif
}

// As Contexts().
static void PairedContexts(const ContextRows& rows, size_t n, ContextScale scale, uint8_t* HWY_RESTRICT contexts) {
  const auto weights = [](int first, int second)
                           HWY_ATTR { return hn::Set(kDSums, static_cast<int16_t>(first | second << 8)); };
  const VSums here = weights(3, 2), beside = weights(2, 1), other = weights(4, 2), after = weights(2, 0);
  const VSums bias = hn::Set(kDSums, static_cast<int16_t>(scale.bias)), most = hn::Set(kDSums, int16_t{15});
  const auto context = [&](VSums sum) HWY_ATTR {
    const VSums c = hn::ShiftRightSame(hn::Sub(sum, bias), scale.shift);
    return hn::ShiftRightSame(hn::Min(hn::Max(c, hn::Zero(kDSums)), most), scale.merges);
  };
  size_t x = 0;
  for (; x + hn::Lanes(kDBytes) <= n; x += hn::Lanes(kDBytes)) {
    VSums low = hn::Zero(kDSums), high = low;
    const auto add = [&](VBytes a, VBytes b, VSums w) HWY_ATTR {
      low = hn::Add(low, BytePairs(hn::InterleaveLower(kDBytes, a, b), w));
      high = hn::Add(high, BytePairs(hn::InterleaveUpper(kDBytes, a, b), w));
    };
    const auto load = [&](const uint8_t* from) HWY_ATTR { return hn::LoadU(kDBytes, from + x); };
    add(load(rows.above), load(rows.above - 1), here), add(load(rows.above + 1), load(rows.above2), beside);
    if (rows.other != nullptr) {
      add(load(rows.other), load(rows.other - 1), other);
      add(load(rows.other + 1), hn::Zero(kDBytes), after);
    }
    hn::StoreU(Joined(context(low), context(high)), kDBytes, contexts + x);
  }
  if (x < n)
    Contexts({rows.above + x, rows.above2 + x, rows.other != nullptr ? rows.other + x : nullptr}, n - x, scale,
             contexts + x);
}

#else
constexpr auto PairedContexts = Contexts;
#endif
