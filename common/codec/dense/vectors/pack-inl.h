// Rows with holes and rows without, with vectors. Included once for every instruction set, in its namespace.
// No include guard: that is meant.

#if HWY_TARGET <= HWY_AVX3

// As Pack() and UnpackWide().
static void PackWide(const uint64_t* words, const uint32_t* from, size_t n, uint32_t* to) {
  for (size_t x = 0; x < n; x += 16) {
    const auto bits = static_cast<__mmask16>(words[x / 64] >> x % 64);
    _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(bits, _mm512_loadu_si512(from + x)));
    to += std::popcount(bits);
  }
}

static void UnpackWideVector(const uint64_t* words, const uint8_t*, const uint32_t* from, size_t n, uint32_t* to) {
  for (size_t x = 0; x < n; x += 16) {
    const auto bits = static_cast<__mmask16>(words[x / 64] >> x % 64);
    _mm512_storeu_si512(to + x, _mm512_maskz_expand_epi32(bits, _mm512_loadu_si512(from)));
    from += std::popcount(bits);
  }
}

#else
constexpr auto PackWide = Pack<uint32_t>;
constexpr auto UnpackWideVector = UnpackWide;
#endif

#if HWY_TARGET <= HWY_AVX3_DL

static void PackBytes(const uint64_t* words, const uint8_t* from, size_t n, uint8_t* to) {
  for (size_t x = 0; x < n; x += 64) {
    const uint64_t bits = words[x / 64];
    _mm512_storeu_si512(to, _mm512_maskz_compress_epi8(bits, _mm512_loadu_si512(from + x)));
    to += std::popcount(bits);
  }
}

static void PackShorts(const uint64_t* words, const uint16_t* from, size_t n, uint16_t* to) {
  for (size_t x = 0; x < n; x += 32) {
    const auto bits = static_cast<uint32_t>(words[x / 64] >> x % 64);
    _mm512_storeu_si512(to, _mm512_maskz_compress_epi16(bits, _mm512_loadu_si512(from + x)));
    to += std::popcount(bits);
  }
}

static void UnpackBytes(const uint64_t* words, const uint8_t* from, size_t n, uint8_t* to) {
  for (size_t x = 0; x < n; x += 64) {
    const uint64_t bits = words[x / 64];
    _mm512_storeu_si512(to + x, _mm512_maskz_expand_epi8(bits, _mm512_loadu_si512(from)));
    from += std::popcount(bits);
  }
}

#else
constexpr auto PackBytes = Pack<uint8_t>;
constexpr auto PackShorts = Pack<uint16_t>;
constexpr auto UnpackBytes = Unpack<uint8_t>;
#endif
