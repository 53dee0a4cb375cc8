// Contexts of tokens with vectors: products of bytes, two at a time. Included once for every instruction set, in its
// namespace. No include guard: that is meant.

#if HWY_TARGET <= HWY_AVX2

using DBytes = hn::CappedTag<uint8_t, 64>;
using VBytes = hn::VFromD<DBytes>;
using DSums = hn::Repartition<int16_t, DBytes>;
using VSums = hn::VFromD<DSums>;
constexpr DBytes kDBytes;
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
