// The coder of symbols without vectors. Included by the plain kernels, and by others for what they leave.

static inline void PlainPutWord(uint32_t& x, uint8_t*& out) {
  const uint16_t word = static_cast<uint16_t>(x);
  std::memcpy(out, &word, 2);
  out += 2;
  x >>= 16;
}

static inline void PlainPutBits(uint32_t& x, uint32_t bits, unsigned count, uint8_t*& out) {
  if (x >> (31 - count) != 0) PlainPutWord(x, out);
  x = x << count | bits;
}

// Of the group whose first symbol is `first` of its row.
static inline uint32_t* StatesOf(uint32_t* all, size_t count, size_t first) { return all + (first & (count - kLanes)); }

static uint8_t* PlainPutSymbols(const SymbolRow& row, const EncodeEntry* tables, uint32_t* all, uint8_t* out) {
  const auto raw_bits = [&](uint16_t symbol) {
    const unsigned token = symbol % kSymbols;
    return token < row.first ? 0 : (token - row.first) >> 3;
  };
  for (size_t group = (row.count + kLanes - 1) / kLanes; group-- > 0;) {
    uint32_t* const states = StatesOf(all, row.states, group * kLanes);
    const size_t begin = group * kLanes, n = row.count - begin < kLanes ? row.count - begin : kLanes;
    const uint16_t* const symbols = row.symbols + begin;
    unsigned widest = 0;
    for (size_t i = 0; i < n; ++i) {
      const unsigned k = raw_bits(symbols[i]), low = k < 15 ? k : 15;
      const uint32_t z = (row.wide != nullptr ? row.wide[begin + i] : row.narrow[begin + i]) + 8;
      PlainPutBits(states[i], z & ((1u << low) - 1), low, out);
      widest = k > widest ? k : widest;
    }
    if (widest > 15)
      for (size_t i = 0; i < n; ++i) {
        const unsigned k = raw_bits(symbols[i]);
        if (k > 15) PlainPutBits(states[i], (row.wide[begin + i] + 8) >> 15 & ((1u << (k - 15)) - 1), k - 15, out);
      }
    for (size_t i = 0; i < n; ++i) {
      const EncodeEntry e = tables[symbols[i]];
      const uint32_t complement = e.packed >> EncodeEntry::kComplementAt;
      uint32_t& x = states[i];
      if ((x + (complement << EncodeEntry::kComplementAt)) >> kStateBits != 0) PlainPutWord(x, out);
      const uint32_t shift = e.packed >> EncodeEntry::kShiftAt & EncodeEntry::kShiftMask;
      const uint32_t quotient = static_cast<uint32_t>(uint64_t{x} * e.reciprocal >> 32) >> shift;
      x += (e.packed & EncodeEntry::kAddMask) + quotient * complement;
    }
  }
  return out;
}

static inline bool PlainRefill(uint32_t& x, const uint8_t* begin, const uint8_t*& end) {
  if (x >= kStateLow) return true;
  if (end - begin < 2) return false;
  uint16_t word;
  end -= 2;
  std::memcpy(&word, end, 2);
  x = x << 16 | word;
  return true;
}

// At most kLanes symbols.
static const uint8_t* PlainGetGroup(const DecodedRow& row, size_t first, size_t n, const uint32_t* tables,
                                    uint32_t* states, const uint8_t* begin, const uint8_t* end) {
  uint32_t kept[kLanes];
  unsigned bits[kLanes], widest = 0;
  for (size_t i = n; i-- > 0;) {
    uint32_t& x = states[i];
    const uint32_t entry = tables[row.contexts[first + i] * kFrequencyOne + (x & (kFrequencyOne - 1))];
    const unsigned token = entry >> 24, over = token < row.first ? 0 : token - row.first;
    row.tokens[first + i] = static_cast<uint8_t>(token);
    x = ((entry >> 12 & 0xFFF) + 1) * (x >> kFrequencyBits) + (entry & 0xFFF);
    bits[i] = over >> 3;
    kept[i] = (8 + (over & 7)) << bits[i];
    widest = bits[i] > widest ? bits[i] : widest;
    if (!PlainRefill(x, begin, end)) return nullptr;
  }
  if (widest > 15)
    for (size_t i = n; i-- > 0;) {
      const unsigned k = bits[i] > 15 ? bits[i] - 15 : 0;
      kept[i] += (states[i] & ((1u << k) - 1)) << 15;
      states[i] >>= k;
      if (!PlainRefill(states[i], begin, end)) return nullptr;
    }
  for (size_t i = n; i-- > 0;) {
    const unsigned k = bits[i] < 15 ? bits[i] : 15;
    const uint32_t z = kept[i] + (states[i] & ((1u << k) - 1)) - 8;
    states[i] >>= k;
    if (!PlainRefill(states[i], begin, end)) return nullptr;
    if (row.wide != nullptr)
      row.wide[first + i] = z;
    else
      row.narrow[first + i] = static_cast<uint8_t>(z);
  }
  return end;
}

static const uint8_t* PlainGetSymbols(const DecodedRow& row, const uint32_t* tables, uint32_t* states,
                                      const uint8_t* begin, const uint8_t* end) {
  for (size_t first = 0; first < row.count && end != nullptr; first += kLanes)
    end = PlainGetGroup(row, first, row.count - first < kLanes ? row.count - first : kLanes, tables,
                        StatesOf(states, row.states, first), begin, end);
  return end;
}

static uint32_t* PlainSlots(const uint16_t* frequencies, unsigned alphabet, uint32_t* out) {
  for (unsigned t = 0; t < alphabet; ++t) {
    const uint32_t count = frequencies[t];
    for (uint32_t i = 0; i < count; ++i) out[i] = (t << 24 | (count - 1) << 12) + i;
    out += count;
  }
  return out;
}
