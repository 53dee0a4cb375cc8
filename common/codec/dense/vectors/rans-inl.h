// The coder of symbols with vectors: as dense/rans-inl.h. Included once for every instruction set, in its namespace.
// No include guard: that is meant.

// Writes the lower halves of the states that `full` names, and shifts them out.
HWY_INLINE V Spill(V x, M full, uint8_t*& out) {
  const auto words = hn::TruncateTo(kD16, Gathered(hn::And(x, hn::Set(kD, 0xFFFFu)), full));
  hn::StoreU(words, kD16, reinterpret_cast<uint16_t*>(out));
  out += 2 * hn::CountTrue(kD, full);
  return hn::IfThenElse(full, hn::ShiftRight<16>(x), x);
}

HWY_INLINE V High32(V a, V b) {
  const hn::RepartitionToWide<D> wide;
  const auto down = [&](V v) HWY_ATTR { return hn::BitCast(kD, hn::ShiftRight<32>(hn::BitCast(wide, v))); };
  const auto even = hn::MulEven(a, b), odd = hn::MulEven(down(a), down(b));
  return hn::OddEven(hn::BitCast(kD, odd), hn::BitCast(kD, hn::ShiftRight<32>(even)));
}

HWY_INLINE M Exceeds(V a, V b) {  // both below 2^31
  const hn::RebindToSigned<D> s;
  return hn::RebindMask(kD, hn::Gt(hn::BitCast(s, a), hn::BitCast(s, b)));
}

HWY_INLINE V Load8(const uint8_t* p) { return hn::PromoteTo(kD, hn::LoadU(kD8, p)); }

// Both halves of the entries at `index`: gathered at once, since a gather takes as long as it has elements.
HWY_INLINE void GatherEntries(const EncodeEntry* tables, V index, V& reciprocal, V& packed) {
#if HWY_TARGET <= HWY_AVX3
  const __m512i low = _mm512_i32gather_epi64(_mm512_castsi512_si256(index.raw), tables, 8),
                high = _mm512_i32gather_epi64(_mm512_extracti64x4_epi64(index.raw, 1), tables, 8);
  const __m512i even = _mm512_set_epi32(30, 28, 26, 24, 22, 20, 18, 16, 14, 12, 10, 8, 6, 4, 2, 0);
  reciprocal = V{_mm512_permutex2var_epi32(low, even, high)};
  packed = V{_mm512_permutex2var_epi32(low, _mm512_add_epi32(even, _mm512_set1_epi32(1)), high)};
#elif HWY_TARGET == HWY_AVX2
  const auto* const words = reinterpret_cast<const long long*>(tables);
  const __m256 low = _mm256_castsi256_ps(_mm256_i32gather_epi64(words, _mm256_castsi256_si128(index.raw), 8)),
               high = _mm256_castsi256_ps(_mm256_i32gather_epi64(words, _mm256_extracti128_si256(index.raw, 1), 8));
  reciprocal = V{_mm256_permute4x64_epi64(_mm256_castps_si256(_mm256_shuffle_ps(low, high, 0x88)), 0xD8)};
  packed = V{_mm256_permute4x64_epi64(_mm256_castps_si256(_mm256_shuffle_ps(low, high, 0xDD)), 0xD8)};
#else
  const hn::RebindToSigned<D> s;
  const auto* const words = reinterpret_cast<const uint32_t*>(tables);
  const auto at = hn::BitCast(s, hn::Add(index, index));
  reciprocal = hn::GatherIndex(kD, words, at), packed = hn::GatherIndex(kD, words + 1, at);
#endif
}

template <bool kWide>
HWY_INLINE V LoadZ(const SymbolRow& row, size_t at) {
  if constexpr (kWide) return hn::LoadU(kD, row.wide + at);
  return Load8(row.narrow + at);
}

template <bool kWide>
HWY_INLINE uint8_t* PutGroup(const SymbolRow& row, size_t begin, const EncodeEntry* tables, V (&x)[kVectors], size_t n,
                             uint8_t* out) {
  const auto one = hn::Set(kD, 1u), first = hn::Set(kD, row.first), fifteen = hn::Set(kD, 15u);
  V tokens[kVectors], bits[kVectors], z[kVectors];
  auto widest = hn::Zero(kD);
  for (size_t i = 0; i < kVectors; ++i) {
    const M valid = hn::FirstN(kD, n > i * kN ? n - i * kN : 0);
    tokens[i] = hn::IfThenElseZero(valid, Load8(row.tokens + begin + i * kN));
    bits[i] = hn::ShiftRight<3>(hn::Sub(hn::Max(tokens[i], first), first));
    widest = hn::Max(widest, bits[i]);
  }
  const bool any = !hn::AllTrue(kD, hn::Eq(widest, hn::Zero(kD)));
  for (size_t i = 0; any && i < kVectors; ++i) {
    z[i] = hn::Add(LoadZ<kWide>(row, begin + i * kN), hn::Set(kD, 8u));
    const V low = kWide ? hn::Min(bits[i], fifteen) : bits[i];
    const V limit = hn::Sub(hn::Shl(one, hn::Sub(hn::Set(kD, 31u), low)), one);
    x[i] = Spill(x[i], Exceeds(x[i], limit), out);
    x[i] = hn::Or(hn::Shl(x[i], low), hn::And(z[i], hn::Sub(hn::Shl(one, low), one)));
  }
  if (kWide && !hn::AllFalse(kD, hn::Gt(widest, fifteen)))
    for (size_t i = 0; i < kVectors; ++i) {
      const V high = hn::Sub(hn::Max(bits[i], fifteen), fifteen);
      const V limit = hn::Sub(hn::Shl(one, hn::Sub(hn::Set(kD, 31u), high)), one);
      x[i] = Spill(x[i], Exceeds(x[i], limit), out);
      x[i] = hn::Or(hn::Shl(x[i], high), hn::And(hn::ShiftRight<15>(z[i]), hn::Sub(hn::Shl(one, high), one)));
    }
  for (size_t i = 0; i < kVectors; ++i) {
    const size_t left = n > i * kN ? n - i * kN : 0;
    const M valid = hn::FirstN(kD, left);
    const V contexts = hn::IfThenElseZero(valid, Load8(row.contexts + begin + i * kN));
    V reciprocal, packed;
    GatherEntries(tables, hn::Add(tokens[i], hn::ShiftLeft<8>(contexts)), reciprocal, packed);
    const V complement = hn::And(hn::ShiftRight<13>(packed), hn::Set(kD, 0xFFFu));
    const V limit =
        hn::Sub(hn::ShiftLeft<kStateBits - kFrequencyBits>(hn::Sub(hn::Set(kD, kFrequencyOne), complement)), one);
    V y = Spill(x[i], hn::And(valid, Exceeds(x[i], limit)), out);
    const V quotient = hn::Shr(High32(y, reciprocal), hn::ShiftRight<25>(packed));
    y = hn::Add(hn::Add(y, hn::And(packed, hn::Set(kD, 0x1FFFu))), hn::Mul(quotient, complement));
    x[i] = hn::IfThenElse(valid, y, x[i]);
  }
  return out;
}

template <bool kWide, size_t kSets>
HWY_INLINE uint8_t* PutAll(const SymbolRow& row, const EncodeEntry* tables, uint32_t* states, uint8_t* out) {
  V x[kSets][kVectors];
  for (size_t i = 0; i < kSets * kVectors; ++i) x[i / kVectors][i % kVectors] = hn::LoadU(kD, states + i * kN);
  size_t begin = row.count / kLanes * kLanes;
  const auto put = [&](size_t n) HWY_ATTR {
    if (kSets > 1 && begin / kLanes % 2 != 0)
      out = PutGroup<kWide>(row, begin, tables, x[kSets - 1], n, out);
    else
      out = PutGroup<kWide>(row, begin, tables, x[0], n, out);
  };
  if (begin != row.count) put(row.count - begin);
  if (kSets > 1 && begin / kLanes % 2 != 0) begin -= kLanes, put(kLanes);
  while (begin != 0) {
    begin -= kSets * kLanes;
    for (size_t set = kSets; set-- > 0;) out = PutGroup<kWide>(row, begin + set * kLanes, tables, x[set], kLanes, out);
  }
  for (size_t i = 0; i < kSets * kVectors; ++i) hn::StoreU(x[i / kVectors][i % kVectors], kD, states + i * kN);
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
HWY_INLINE V Refill(V x, const uint8_t*& end) {
  const M low = Exceeds(hn::Set(kD, kStateLow), x);
  end -= 2 * hn::CountTrue(kD, low);
  const V words = hn::PromoteTo(kD, hn::LoadU(kD16, reinterpret_cast<const uint16_t*>(end)));
  return hn::IfThenElse(low, hn::Or(hn::ShiftLeft<16>(x), Spread(words, low)), x);
}

// n symbols, at most kLanes; there must be 3 kLanes words before `end`. Writes kLanes of them.
template <bool kWhole, bool kWide>
HWY_INLINE const uint8_t* GetGroup(const DecodedRow& row, size_t begin, size_t n, const uint32_t* tables,
                                   V (&x)[kVectors], const uint8_t* end) {
  const hn::RebindToSigned<D> s;
  const auto one = hn::Set(kD, 1u), first = hn::Set(kD, row.first), fifteen = hn::Set(kD, 15u);
  V kept[kVectors], bits[kVectors];
  auto widest = hn::Zero(kD);
  for (size_t i = kVectors; i-- > 0;) {
    const M valid = hn::FirstN(kD, kWhole ? kN : n > i * kN ? n - i * kN : 0);
    V contexts = Load8(row.contexts + begin + i * kN);
    if constexpr (!kWhole) contexts = hn::IfThenElseZero(valid, contexts);
    const V index = hn::Or(hn::ShiftLeft<kFrequencyBits>(contexts), hn::And(x[i], hn::Set(kD, kFrequencyOne - 1)));
    const V entry = hn::GatherIndex(kD, tables, hn::BitCast(s, index));
    const V token = hn::ShiftRight<24>(entry);
    hn::StoreU(hn::TruncateTo(kD8, token), kD8, row.tokens + begin + i * kN);
    const V frequency = hn::Add(hn::And(hn::ShiftRight<12>(entry), hn::Set(kD, 0xFFFu)), one);
    const V next =
        hn::Add(hn::Mul(frequency, hn::ShiftRight<kFrequencyBits>(x[i])), hn::And(entry, hn::Set(kD, 0xFFFu)));
    x[i] = Refill(kWhole ? next : hn::IfThenElse(valid, next, x[i]), end);
    V over = hn::Sub(hn::Max(token, first), first);
    if constexpr (!kWhole) over = hn::IfThenElseZero(valid, over);
    bits[i] = hn::ShiftRight<3>(over);
    kept[i] = hn::Shl(hn::Add(hn::And(over, hn::Set(kD, 7u)), hn::Set(kD, 8u)), bits[i]);
    widest = hn::Max(widest, bits[i]);
  }
  if (kWide && !hn::AllFalse(kD, hn::Gt(widest, fifteen)))
    for (size_t i = kVectors; i-- > 0;) {
      const V high = hn::Sub(hn::Max(bits[i], fifteen), fifteen);
      kept[i] = hn::Add(kept[i], hn::ShiftLeft<15>(hn::And(x[i], hn::Sub(hn::Shl(one, high), one))));
      x[i] = Refill(hn::Shr(x[i], high), end);
    }
  const bool any = !hn::AllTrue(kD, hn::Eq(widest, hn::Zero(kD)));
  for (size_t i = kVectors; i-- > 0;) {
    V z = hn::Sub(kept[i], hn::Set(kD, 8u));
    if (any) {
      const V low = hn::Min(bits[i], fifteen);
      z = hn::Add(z, hn::And(x[i], hn::Sub(hn::Shl(one, low), one)));
      x[i] = Refill(hn::Shr(x[i], low), end);
    }
    if constexpr (kWide)
      hn::StoreU(z, kD, row.wide + begin + i * kN);
    else
      hn::StoreU(hn::TruncateTo(kD8, z), kD8, row.narrow + begin + i * kN);
  }
  return end;
}

template <bool kWide, size_t kSets>
HWY_INLINE const uint8_t* GetAll(const DecodedRow& row, const uint32_t* tables, uint32_t* states, const uint8_t* begin,
                                 const uint8_t* end) {
  V x[kSets][kVectors];
  for (size_t i = 0; i < kSets * kVectors; ++i) x[i / kVectors][i % kVectors] = hn::LoadU(kD, states + i * kN);
  constexpr size_t kMostBytes = 6 * kLanes;  // of a group
  // Words that are none are found afterwards, where what is read is memory at least.
  const uint8_t* const lowest = row.readable != nullptr ? row.readable : begin;
  const auto enough = [&](size_t groups) {
    return end >= begin && static_cast<size_t>(end - lowest) >= groups * kMostBytes;
  };
  size_t at = 0;
  for (; at + kSets * kLanes <= row.count && enough(kSets); at += kSets * kLanes)
    for (size_t set = 0; set < kSets; ++set)
      end = GetGroup<true, kWide>(row, at + set * kLanes, kLanes, tables, x[set], end);
  size_t set = 0;  // of the next group
  if (kSets > 1 && at + kLanes <= row.count && enough(1)) {
    end = GetGroup<true, kWide>(row, at, kLanes, tables, x[0], end);
    at += kLanes, set = 1;
  }
  if (at < row.count && row.count - at < kLanes && enough(1)) {
    const size_t n = row.count - at;
    HWY_ALIGN uint8_t contexts[kLanes] = {}, tokens[kLanes], narrow[kLanes];
    HWY_ALIGN uint32_t wide[kLanes];
    std::memcpy(contexts, row.contexts + at, n);
    const DecodedRow rest{contexts, tokens, wide, narrow, n, row.first};
    if (set == 0)
      end = GetGroup<false, kWide>(rest, 0, n, tables, x[0], end);
    else
      end = GetGroup<false, kWide>(rest, 0, n, tables, x[kSets - 1], end);
    std::memcpy(row.tokens + at, tokens, n);
    if constexpr (kWide)
      std::memcpy(row.wide + at, wide, 4 * n);
    else
      std::memcpy(row.narrow + at, narrow, n);
    at = row.count;
  }
  for (size_t i = 0; i < kSets * kVectors; ++i) hn::StoreU(x[i / kVectors][i % kVectors], kD, states + i * kN);
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
