// The coder of symbols with vectors: as dense/rans-inl.h. Included once for every instruction set, in its namespace.
// No include guard: that is meant.

HWY_INLINE M Exceeds(V a, V b) {  // both below 2^31
  const hn::RebindToSigned<D> s;
  return hn::RebindMask(kD, hn::Gt(hn::BitCast(s, a), hn::BitCast(s, b)));
}

HWY_INLINE M IsNegative(V v) {
  const hn::RebindToSigned<D> s;
  return hn::RebindMask(kD, hn::Lt(hn::BitCast(s, v), hn::Zero(s)));
}

// Writes the lower halves of the states that `full` names, and shifts them out.
HWY_INLINE uint8_t* Spill(V (&x)[kVectors], const M (&full)[kVectors], uint8_t* out) {
#if HWY_TARGET <= HWY_AVX3_DL
  static_assert(kVectors == 2);
  HWY_ALIGN static constexpr auto kLowerHalves = [] {
    std::array<uint16_t, kLanes> of{};
    for (size_t i = 0; i < kLanes; ++i) of[i] = static_cast<uint16_t>(2 * i);
    return of;
  }();
  const __mmask32 both = _mm512_kunpackw(full[1].raw, full[0].raw);
  const __m512i words = _mm512_permutex2var_epi16(x[0].raw, _mm512_load_si512(kLowerHalves.data()), x[1].raw);
  _mm512_storeu_si512(out, _mm512_maskz_compress_epi16(both, words));
  out += 2 * std::popcount(static_cast<uint32_t>(both));
  HWY_UNROLL(8)
  for (size_t i = 0; i < kVectors; ++i) x[i] = V{_mm512_mask_srli_epi32(x[i].raw, full[i].raw, x[i].raw, 16)};
#else
  HWY_UNROLL(8) for (size_t i = 0; i < kVectors; ++i) {
    const auto words = hn::TruncateTo(kD16, Gathered(hn::And(x[i], hn::Set(kD, 0xFFFFu)), full[i]));
    hn::StoreU(words, kD16, reinterpret_cast<uint16_t*>(out));
    out += 2 * hn::CountTrue(kD, full[i]);
    x[i] = hn::IfThenElse(full[i], hn::ShiftRight<16>(x[i]), x[i]);
  }
#endif
  return out;
}

HWY_INLINE V Load8(const uint8_t* p) { return hn::PromoteTo(kD, hn::LoadU(kD8, p)); }

#if HWY_TARGET <= HWY_AVX2
HWY_INLINE __m256i Joined(__m128i low, __m128i high) {
  return _mm256_inserti128_si256(_mm256_castsi128_si256(low), high, 1);
}
#endif
#if HWY_TARGET <= HWY_AVX3
HWY_INLINE __m512i Joined(__m256i low, __m256i high) {
  return _mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1);
}
#endif

// Of the entries of kN symbols: the upper half of x * reciprocal, and what is packed. Both halves of an entry are
// loaded at once, one entry after the other: that takes half of a gather's time.
class Entries {
 public:
  HWY_INLINE void Load(const EncodeEntry* tables, const uint16_t* symbols) {
#if HWY_TARGET <= HWY_AVX2
    const Pairs first(tables, symbols), second(tables, symbols + 4);
#if HWY_TARGET <= HWY_AVX3
    const Pairs third(tables, symbols + 8), fourth(tables, symbols + 12);
    even_ = Joined(Joined(first.even, second.even), Joined(third.even, fourth.even));
    odd_ = Joined(Joined(first.odd, second.odd), Joined(third.odd, fourth.odd));
#else
    even_ = Joined(first.even, second.even), odd_ = Joined(first.odd, second.odd);
#endif
#else
    HWY_ALIGN uint32_t reciprocals[kN], packed[kN];
    for (size_t i = 0; i < kN; ++i)
      reciprocals[i] = tables[symbols[i]].reciprocal, packed[i] = tables[symbols[i]].packed;
    reciprocal_ = hn::Load(kD, reciprocals), packed_ = hn::Load(kD, packed);
#endif
  }
  HWY_INLINE V Packed() const {
#if HWY_TARGET <= HWY_AVX2
    return UpperHalves(even_, odd_);
#else
    return packed_;
#endif
  }
  HWY_INLINE V Products(V x) const {
#if HWY_TARGET <= HWY_AVX3
    return UpperHalves(_mm512_mul_epu32(x.raw, even_), _mm512_mul_epu32(_mm512_srli_epi64(x.raw, 32), odd_));
#elif HWY_TARGET == HWY_AVX2
    return UpperHalves(_mm256_mul_epu32(x.raw, even_), _mm256_mul_epu32(_mm256_srli_epi64(x.raw, 32), odd_));
#else
    const hn::RepartitionToWide<D> wide;
    const auto down = [&](V v) HWY_ATTR { return hn::BitCast(kD, hn::ShiftRight<32>(hn::BitCast(wide, v))); };
    const auto even = hn::MulEven(x, reciprocal_), odd = hn::MulEven(down(x), down(reciprocal_));
    return hn::OddEven(hn::BitCast(kD, odd), hn::BitCast(kD, hn::ShiftRight<32>(even)));
#endif
  }

 private:
#if HWY_TARGET <= HWY_AVX2
  struct Pairs {  // of four symbols
    __m128i even, odd;
    HWY_INLINE Pairs(const EncodeEntry* tables, const uint16_t* symbols) {
      uint64_t four;
      std::memcpy(&four, symbols, sizeof four);
      even = Pair(tables + (four & 0xFFFF), tables + (four >> 32 & 0xFFFF));
      odd = Pair(tables + (four >> 16 & 0xFFFF), tables + (four >> 48));
    }
    static HWY_INLINE __m128i Pair(const EncodeEntry* first, const EncodeEntry* second) {
      const __m128 low = _mm_castsi128_ps(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(first)));
      return _mm_castps_si128(_mm_loadh_pi(low, reinterpret_cast<const __m64*>(second)));
    }
  };
#if HWY_TARGET <= HWY_AVX3
  static HWY_INLINE V UpperHalves(__m512i even, __m512i odd) {
    return V{_mm512_mask_shuffle_epi32(odd, 0x5555, even, _MM_PERM_DDBB)};
  }
  __m512i even_, odd_;  // reciprocals, and above them what is packed
#else
  static HWY_INLINE V UpperHalves(__m256i even, __m256i odd) {
    return V{_mm256_blend_epi32(_mm256_srli_epi64(even, 32), odd, 0xAA)};
  }
  __m256i even_, odd_;
#endif
#else
  V reciprocal_, packed_;
#endif
};

template <bool kWide>
HWY_INLINE V LoadZ(const SymbolRow& row, size_t at) {
  if constexpr (kWide) return hn::LoadU(kD, row.wide + at);
  return Load8(row.narrow + at);
}

// count[i] bits of each z, from its lowest on.
HWY_INLINE uint8_t* PutRaw(V (&x)[kVectors], const V (&count)[kVectors], const V (&z)[kVectors], uint8_t* out) {
  M full[kVectors];
  HWY_UNROLL(8)
  for (size_t i = 0; i < kVectors; ++i)
    full[i] = Exceeds(hn::Shr(x[i], hn::Sub(hn::Set(kD, kStateBits), count[i])), hn::Zero(kD));
  out = Spill(x, full, out);
  HWY_UNROLL(8) for (size_t i = 0; i < kVectors; ++i) {
#if HWY_TARGET <= HWY_AVX3_DL
    const V top = hn::Shl(z[i], hn::Sub(hn::Set(kD, 32u), count[i]));
    x[i] = V{_mm512_shldv_epi32(x[i].raw, top.raw, count[i].raw)};
#else
    const V one = hn::Set(kD, 1u), mask = hn::Sub(hn::Shl(one, count[i]), one);
    x[i] = hn::Or(hn::Shl(x[i], count[i]), hn::And(z[i], mask));
#endif
  }
  return out;
}

// kLanes symbols, of which the first n count: of others there is a token of 0.
template <bool kWhole, bool kWide>
HWY_INLINE uint8_t* PutGroup(const SymbolRow& row, size_t begin, const EncodeEntry* tables, V (&x)[kVectors], size_t n,
                             uint8_t* out) {
  const auto first = hn::Set(kD, row.first), fifteen = hn::Set(kD, 15u);
  const uint16_t* const symbols = row.symbols + begin;
  V bits[kVectors], z[kVectors];
  auto widest = hn::Zero(kD);
  HWY_UNROLL(8) for (size_t i = 0; i < kVectors; ++i) {
    const V token = hn::And(hn::PromoteTo(kD, hn::LoadU(kD16, symbols + i * kN)), hn::Set(kD, kSymbols - 1u));
    bits[i] = hn::ShiftRight<3>(hn::Sub(hn::Max(token, first), first));
    widest = hn::Max(widest, bits[i]);
  }
  if (!hn::AllTrue(kD, hn::Eq(widest, hn::Zero(kD)))) {
    V low[kVectors];
    HWY_UNROLL(8) for (size_t i = 0; i < kVectors; ++i) {
      z[i] = hn::Add(LoadZ<kWide>(row, begin + i * kN), hn::Set(kD, 8u));
      low[i] = kWide ? hn::Min(bits[i], fifteen) : bits[i];
    }
    out = PutRaw(x, low, z, out);
  }
  if (kWide && !hn::AllFalse(kD, hn::Gt(widest, fifteen))) {
    V high[kVectors];
    HWY_UNROLL(8)
    for (size_t i = 0; i < kVectors; ++i)
      high[i] = hn::Sub(hn::Max(bits[i], fifteen), fifteen), z[i] = hn::ShiftRight<15>(z[i]);
    out = PutRaw(x, high, z, out);
  }
  constexpr uint32_t kComplement = (kFrequencyOne - 1) << EncodeEntry::kComplementAt;
  Entries entries[kVectors];
  V packed[kVectors];
  M full[kVectors];
  const auto valid = [&](size_t i) HWY_ATTR { return hn::FirstN(kD, n > i * kN ? n - i * kN : 0); };
  HWY_UNROLL(8) for (size_t i = 0; i < kVectors; ++i) {
    entries[i].Load(tables, symbols + i * kN);
    packed[i] = entries[i].Packed();
    full[i] = IsNegative(hn::Add(x[i], hn::And(packed[i], hn::Set(kD, kComplement))));
    if constexpr (!kWhole) full[i] = hn::And(valid(i), full[i]);
  }
  out = Spill(x, full, out);
  HWY_UNROLL(8) for (size_t i = 0; i < kVectors; ++i) {
    const V shift = hn::And(hn::ShiftRight<EncodeEntry::kShiftAt>(packed[i]), hn::Set(kD, EncodeEntry::kShiftMask));
    const V quotient = hn::Shr(entries[i].Products(x[i]), shift);
    const V next = hn::Add(hn::Add(x[i], hn::And(packed[i], hn::Set(kD, EncodeEntry::kAddMask))),
                           hn::Mul(quotient, hn::ShiftRight<EncodeEntry::kComplementAt>(packed[i])));
    x[i] = kWhole ? next : hn::IfThenElse(valid(i), next, x[i]);
  }
  return out;
}

// What is left of a row after its whole groups.
template <bool kWide>
HWY_INLINE uint8_t* PutRest(const SymbolRow& row, size_t begin, const EncodeEntry* tables, V (&x)[kVectors],
                            uint8_t* out) {
  HWY_ALIGN uint16_t symbols[kLanes] = {};
  std::memcpy(symbols, row.symbols + begin, (row.count - begin) * sizeof *symbols);
  SymbolRow rest = row;
  rest.symbols = symbols;
  if constexpr (kWide)
    rest.wide += begin;
  else
    rest.narrow += begin;
  return PutGroup<false, kWide>(rest, 0, tables, x, row.count - begin, out);
}

template <bool kWide, size_t kSets>
HWY_INLINE uint8_t* PutAll(const SymbolRow& row, const EncodeEntry* tables, uint32_t* states, uint8_t* out) {
  V x[kVectors], other[kVectors];  // `other`: of every second group, where there are two sets of states
  uint32_t* const others = states + (kSets - 1) * kLanes;
  HWY_UNROLL(8)
  for (size_t i = 0; i < kVectors; ++i)
    x[i] = hn::LoadU(kD, states + i * kN), other[i] = hn::LoadU(kD, others + i * kN);
  size_t begin = row.count / kLanes * kLanes;
  if (begin != row.count)
    out = kSets > 1 && begin / kLanes % 2 != 0 ? PutRest<kWide>(row, begin, tables, other, out)
                                               : PutRest<kWide>(row, begin, tables, x, out);
  if (kSets > 1 && begin / kLanes % 2 != 0) {
    begin -= kLanes;
    out = PutGroup<true, kWide>(row, begin, tables, x, kLanes, out);
  }
  while (begin != 0) {
    begin -= kSets * kLanes;
    if constexpr (kSets > 1) out = PutGroup<true, kWide>(row, begin + kLanes, tables, other, kLanes, out);
    out = PutGroup<true, kWide>(row, begin, tables, x, kLanes, out);
  }
  HWY_UNROLL(8) for (size_t i = 0; i < kVectors; ++i) {
    hn::StoreU(x[i], kD, states + i * kN);
    if constexpr (kSets > 1) hn::StoreU(other[i], kD, others + i * kN);
  }
  return out;
}

template <size_t kSets>
HWY_INLINE uint8_t* PutSets(const SymbolRow& row, const EncodeEntry* tables, uint32_t* states, uint8_t* out) {
  return row.wide != nullptr ? PutAll<true, kSets>(row, tables, states, out)
                             : PutAll<false, kSets>(row, tables, states, out);
}

static uint8_t* PutSymbols(const SymbolRow& row, const EncodeEntry* tables, uint32_t* states, uint8_t* out) {
  return row.states > kLanes ? PutSets<2>(row, tables, states, out) : PutSets<1>(row, tables, states, out);
}

// Puts the first elements of v to where `to` is set, in order.
HWY_INLINE V Spread(V v, M to) {
#if HWY_TARGET <= HWY_AVX3
  return V{_mm512_maskz_expand_epi32(to.raw, v.raw)};
#else
  uint8_t bits[8] = {};
  hn::StoreMaskBits(kD, to, bits);
  return hn::TableLookupLanes(v, hn::SetTableIndices(kD, kRanks.of[bits[0]]));
#endif
}

// Fills up the states that are below kStateLow with the words before `end`.
HWY_INLINE const uint8_t* Refill(V (&x)[kVectors], const uint8_t* end) {
  HWY_UNROLL(8) for (size_t i = kVectors; i-- > 0;) {
    const M low = Exceeds(hn::Set(kD, kStateLow), x[i]);
    end -= 2 * hn::CountTrue(kD, low);
    const V words = hn::PromoteTo(kD, hn::LoadU(kD16, reinterpret_cast<const uint16_t*>(end)));
    x[i] = hn::IfThenElse(low, hn::Or(hn::ShiftLeft<16>(x[i]), Spread(words, low)), x[i]);
  }
  return end;
}

// The lowest count[i] bits of each state, which leave it.
HWY_INLINE const uint8_t* GetRaw(V (&x)[kVectors], const V (&count)[kVectors], V (&bits)[kVectors],
                                 const uint8_t* end) {
  const V one = hn::Set(kD, 1u);
  HWY_UNROLL(8) for (size_t i = 0; i < kVectors; ++i) {
    bits[i] = hn::And(x[i], hn::Sub(hn::Shl(one, count[i]), one));
    x[i] = hn::Shr(x[i], count[i]);
  }
  return Refill(x, end);
}

#if HWY_TARGET <= HWY_AVX2
HWY_INLINE uint64_t LowerWord(__m128i v) { return static_cast<uint64_t>(_mm_cvtsi128_si64(v)); }
HWY_INLINE uint64_t UpperWord(__m128i v) { return static_cast<uint64_t>(_mm_extract_epi64(v, 1)); }
#endif

// tables[i] of each i below 2^16, one after the other: gathers take half as long again.
HWY_INLINE V EntriesAt(const uint32_t* tables, V i) {
#if HWY_TARGET <= HWY_AVX2
  const auto four = [&](uint64_t at) HWY_ATTR {
    const auto entry = [&](int shift) HWY_ATTR { return static_cast<int>(tables[at >> shift & 0xFFFF]); };
    __m128i of = _mm_cvtsi32_si128(entry(0));
    of = _mm_insert_epi32(of, entry(16), 1), of = _mm_insert_epi32(of, entry(32), 2);
    return _mm_insert_epi32(of, entry(48), 3);
  };
#if HWY_TARGET <= HWY_AVX3
  const __m256i at = _mm512_cvtepi32_epi16(i.raw);
  const __m128i first = _mm256_castsi256_si128(at), second = _mm256_extracti128_si256(at, 1);
  return V{Joined(Joined(four(LowerWord(first)), four(UpperWord(first))),
                  Joined(four(LowerWord(second)), four(UpperWord(second))))};
#else
  const __m256i at = _mm256_packus_epi32(i.raw, i.raw);
  return V{Joined(four(LowerWord(_mm256_castsi256_si128(at))), four(LowerWord(_mm256_extracti128_si256(at, 1))))};
#endif
#else
  return hn::GatherIndex(kD, tables, hn::BitCast(hn::RebindToSigned<D>(), i));
#endif
}

// n symbols, at most kLanes; there must be 3 kLanes words before `end`. Writes kLanes of them.
template <bool kWhole, bool kWide>
HWY_INLINE const uint8_t* GetGroup(const DecodedRow& row, size_t begin, size_t n, const uint32_t* tables,
                                   V (&x)[kVectors], const uint8_t* end) {
  const V one = hn::Set(kD, 1u), first = hn::Set(kD, row.first), fifteen = hn::Set(kD, 15u);
  V z[kVectors], bits[kVectors], raw[kVectors];
  V widest = hn::Zero(kD);
  HWY_UNROLL(8) for (size_t i = 0; i < kVectors; ++i) {
    const M valid = hn::FirstN(kD, kWhole ? kN : n > i * kN ? n - i * kN : 0);
    V contexts = Load8(row.contexts + begin + i * kN);
    if constexpr (!kWhole) contexts = hn::IfThenElseZero(valid, contexts);
    const V index = hn::Or(hn::ShiftLeft<kFrequencyBits>(contexts), hn::And(x[i], hn::Set(kD, kFrequencyOne - 1)));
    const V entry = EntriesAt(tables, index);
    const V token = hn::ShiftRight<24>(entry);
    hn::StoreU(LowBytes(token), kD8, row.tokens + begin + i * kN);
    const V frequency = hn::Add(hn::And(hn::ShiftRight<12>(entry), hn::Set(kD, 0xFFFu)), one);
    const V next =
        hn::Add(hn::Mul(frequency, hn::ShiftRight<kFrequencyBits>(x[i])), hn::And(entry, hn::Set(kD, 0xFFFu)));
    x[i] = kWhole ? next : hn::IfThenElse(valid, next, x[i]);
    V over = hn::Sub(hn::Max(token, first), first);
    if constexpr (!kWhole) over = hn::IfThenElseZero(valid, over);
    bits[i] = hn::ShiftRight<3>(over);
    z[i] = hn::Sub(hn::Shl(hn::Add(hn::And(over, hn::Set(kD, 7u)), hn::Set(kD, 8u)), bits[i]), hn::Set(kD, 8u));
    widest = hn::Max(widest, bits[i]);
  }
  end = Refill(x, end);
  if (kWide && !hn::AllFalse(kD, hn::Gt(widest, fifteen))) {
    V high[kVectors];
    HWY_UNROLL(8) for (size_t i = 0; i < kVectors; ++i) {
      high[i] = hn::Sub(hn::Max(bits[i], fifteen), fifteen);
      bits[i] = hn::Min(bits[i], fifteen);
    }
    end = GetRaw(x, high, raw, end);
    HWY_UNROLL(8) for (size_t i = 0; i < kVectors; ++i) z[i] = hn::Add(z[i], hn::ShiftLeft<15>(raw[i]));
  }
  if (!hn::AllTrue(kD, hn::Eq(widest, hn::Zero(kD)))) {
    end = GetRaw(x, bits, raw, end);
    HWY_UNROLL(8) for (size_t i = 0; i < kVectors; ++i) z[i] = hn::Add(z[i], raw[i]);
  }
  HWY_UNROLL(8) for (size_t i = 0; i < kVectors; ++i) {
    if constexpr (kWide)
      hn::StoreU(z[i], kD, row.wide + begin + i * kN);
    else
      hn::StoreU(LowBytes(z[i]), kD8, row.narrow + begin + i * kN);
  }
  return end;
}

// What is left of a row after its whole groups.
template <bool kWide>
HWY_INLINE const uint8_t* GetRest(const DecodedRow& row, size_t begin, const uint32_t* tables, V (&x)[kVectors],
                                  const uint8_t* end) {
  const size_t n = row.count - begin;
  HWY_ALIGN uint8_t contexts[kLanes] = {}, tokens[kLanes], narrow[kLanes];
  HWY_ALIGN uint32_t wide[kLanes];
  std::memcpy(contexts, row.contexts + begin, n);
  end = GetGroup<false, kWide>({contexts, tokens, wide, narrow, n, row.first}, 0, n, tables, x, end);
  std::memcpy(row.tokens + begin, tokens, n);
  if constexpr (kWide)
    std::memcpy(row.wide + begin, wide, 4 * n);
  else
    std::memcpy(row.narrow + begin, narrow, n);
  return end;
}

template <bool kWide, size_t kSets>
HWY_INLINE const uint8_t* GetAll(const DecodedRow& row, const uint32_t* tables, uint32_t* states, const uint8_t* begin,
                                 const uint8_t* end) {
  V x[kVectors], other[kVectors];  // `other`: of every second group, where there are two sets of states
  uint32_t* const others = states + (kSets - 1) * kLanes;
  HWY_UNROLL(8)
  for (size_t i = 0; i < kVectors; ++i)
    x[i] = hn::LoadU(kD, states + i * kN), other[i] = hn::LoadU(kD, others + i * kN);
  constexpr size_t kMostBytes = 6 * kLanes;  // of a group
  // Words that are none are found afterwards, where what is read is memory at least.
  const uint8_t* const lowest = row.readable != nullptr ? row.readable : begin;
  const auto enough = [&](size_t groups) {
    return end >= begin && static_cast<size_t>(end - lowest) >= groups * kMostBytes;
  };
  size_t at = 0;
  for (; at + kSets * kLanes <= row.count && enough(kSets); at += kSets * kLanes) {
    end = GetGroup<true, kWide>(row, at, kLanes, tables, x, end);
    if constexpr (kSets > 1) end = GetGroup<true, kWide>(row, at + kLanes, kLanes, tables, other, end);
  }
  const bool second = kSets > 1 && at + kLanes <= row.count && enough(1);  // states are of the next group
  if (second) {
    end = GetGroup<true, kWide>(row, at, kLanes, tables, x, end);
    at += kLanes;
  }
  if (at < row.count && row.count - at < kLanes && enough(1)) {
    end = second ? GetRest<kWide>(row, at, tables, other, end) : GetRest<kWide>(row, at, tables, x, end);
    at = row.count;
  }
  HWY_UNROLL(8) for (size_t i = 0; i < kVectors; ++i) {
    hn::StoreU(x[i], kD, states + i * kN);
    if constexpr (kSets > 1) hn::StoreU(other[i], kD, others + i * kN);
  }
  if (end < begin) return nullptr;
  for (; at < row.count && end != nullptr; at += kLanes)
    end = PlainGetGroup(row, at, row.count - at < kLanes ? row.count - at : kLanes, tables,
                        StatesOf(states, row.states, at), begin, end);
  return end;
}

template <size_t kSets>
HWY_INLINE const uint8_t* GetSets(const DecodedRow& row, const uint32_t* tables, uint32_t* states, const uint8_t* begin,
                                  const uint8_t* end) {
  return row.wide != nullptr ? GetAll<true, kSets>(row, tables, states, begin, end)
                             : GetAll<false, kSets>(row, tables, states, begin, end);
}

static const uint8_t* GetSymbols(const DecodedRow& row, const uint32_t* tables, uint32_t* states, const uint8_t* begin,
                                 const uint8_t* end) {
  return row.states > kLanes ? GetSets<2>(row, tables, states, begin, end)
                             : GetSets<1>(row, tables, states, begin, end);
}

// As PlainSlots(). What is too much is written over afterwards.
static uint32_t* Slots(const uint16_t* frequencies, unsigned alphabet, uint32_t* out) {
  static_assert(kN <= kMoreSlots);
  const auto places = hn::Iota(kD, 0), step = hn::Set(kD, static_cast<uint32_t>(kN));
  for (unsigned t = 0; t < alphabet; ++t) {
    const uint32_t count = frequencies[t];
    if (count == 0) continue;
    auto entries = hn::Add(places, hn::Set(kD, t << 24 | (count - 1) << 12));
    for (uint32_t i = 0; i < count; i += static_cast<uint32_t>(kN), entries = hn::Add(entries, step))
      hn::StoreU(entries, kD, out + i);
    out += count;
  }
  return out;
}
