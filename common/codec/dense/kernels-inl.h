// Loops that compilers turn into vectors by themselves. Included once for every instruction set, in its namespace.
// No include guard: that is meant.

// fold: 0, -1, 1, -2, ... -> 0, 1, 2, 3, ...
static inline uint32_t Fold24(uint32_t difference) {
  const uint32_t v = difference << 8;
  return ((v << 1) ^ static_cast<uint32_t>(static_cast<int32_t>(v) >> 31)) >> 8;
}

static constexpr uint16_t Least(uint16_t a, uint16_t b) { return a < b ? a : b; }

// token_of() of z < 256: the least of the lines of which the logarithm's approximation is made.
static constexpr uint8_t ByteToken(uint8_t z) {
  const uint16_t v = static_cast<uint16_t>(z + 8);
  uint16_t token = z;
  token = Least(token, static_cast<uint16_t>(v >> 1));
  token = Least(token, static_cast<uint16_t>((v >> 2) + 8));
  token = Least(token, static_cast<uint16_t>((v >> 3) + 16));
  token = Least(token, static_cast<uint16_t>((v >> 4) + 24));
  return static_cast<uint8_t>(Least(token, static_cast<uint16_t>((v >> 5) + 32)));
}

// 255 -> all bits, 0 -> none.
static inline uint32_t Wide(uint8_t cover) { return static_cast<uint32_t>(static_cast<int8_t>(cover)); }
static inline uint16_t Short(uint8_t cover) { return static_cast<uint16_t>(static_cast<int8_t>(cover)); }

static void CutWide(const uint8_t* RESTRICT cover, const uint32_t* from, size_t n, uint32_t* to) {
  for (size_t x = 0; x < n; ++x) to[x] = from[x] & Wide(cover[x]);
}

static void CutShort(const uint8_t* RESTRICT cover, const uint16_t* from, size_t n, uint16_t* to) {
  for (size_t x = 0; x < n; ++x) to[x] = static_cast<uint16_t>(from[x] & Short(cover[x]));
}

// Calls f(begin, count) for the runs of bits that are set in each word.
template <class F>
static inline void ForEachRun(const uint64_t* words, size_t n, F f) {
  for (size_t x = 0; x < n; x += 64)
    for (uint64_t left = words[x / 64]; left != 0;) {
      const int begin = std::countr_zero(left), count = std::countr_one(left >> begin);
      f(x + static_cast<size_t>(begin), static_cast<size_t>(count));
      left = begin + count == 64 ? 0 : left >> (begin + count) << (begin + count);
    }
}

template <class T>
static inline void CopyAbout(const T* RESTRICT from, size_t count, T* RESTRICT to) {
  for (size_t i = 0; i < count; i += 32) std::memcpy(to + i, from + i, 32 * sizeof(T));
}

template <class T>
static void Pack(const uint64_t* words, const T* RESTRICT from, size_t n, T* RESTRICT to) {
  ForEachRun(words, n, [&](size_t begin, size_t count) {
    CopyAbout(from + begin, count, to);
    to += count;
  });
}

template <class T>
static void Unpack(const uint64_t* words, const T* RESTRICT from, size_t n, T* RESTRICT to) {
  ForEachRun(words, n, [&](size_t begin, size_t count) {
    CopyAbout(from, count, to + begin);
    from += count;
  });
}

static void UnpackWide(const uint64_t* words, const uint8_t* cover, const uint32_t* from, size_t n, uint32_t* to) {
  Unpack(words, from, n, to);
  CutWide(cover, to, n, to);
}

static void KeepBytes(const uint8_t* RESTRICT cover, const uint8_t* RESTRICT from, size_t n, uint8_t* RESTRICT row) {
  for (size_t x = 0; x < n; ++x) row[x] = static_cast<uint8_t>(from[x] ^ ((from[x] ^ row[x]) & cover[x]));
}

static void FillValues(const uint8_t* RESTRICT cover, const int16_t* RESTRICT guide, size_t n, int bits, int most,
                       int16_t* RESTRICT row) {
  const int16_t half = static_cast<int16_t>(1 << bits >> 1), largest = static_cast<int16_t>(most);
  const auto nearest = [&](int16_t by) {
    int16_t v = static_cast<int16_t>((by + half) >> bits);
    v = v < 0 ? int16_t{0} : v;
    return static_cast<int16_t>((v > largest ? largest : v) << bits);
  };
  if (cover == nullptr)
    for (size_t x = 0; x < n; ++x) row[x] = nearest(guide[x]);
  else
    for (size_t x = 0; x < n; ++x) {
      const int16_t v = nearest(guide[x]);
      row[x] = static_cast<int16_t>(v ^ ((v ^ row[x]) & static_cast<int16_t>(Short(cover[x]))));
    }
}

static bool Within(const uint8_t* RESTRICT cover, const int16_t* RESTRICT values, const int16_t* RESTRICT residuals,
                   size_t n, int most_guess, int most) {
  const uint16_t largest = static_cast<uint16_t>(most), largest_guess = static_cast<uint16_t>(most_guess);
  uint16_t outside = 0;
  for (size_t x = 0; x < n; ++x) {
    const uint16_t value = static_cast<uint16_t>(values[x]), guess = static_cast<uint16_t>(values[x] - residuals[x]);
    const uint16_t out = static_cast<uint16_t>(0 - ((value > largest) | (guess > largest_guess)));
    outside |= static_cast<uint16_t>(out & (cover != nullptr ? Short(cover[x]) : 0xFFFF));
  }
  return outside == 0;
}

static uint32_t LargestLessOne(const uint8_t* RESTRICT cover, const uint32_t* RESTRICT row, size_t n) {
  uint32_t largest = 0;
  for (size_t x = 0; x < n; ++x) {
    const uint32_t v = (row[x] - 1) & (cover != nullptr ? Wide(cover[x]) : ~0u);
    largest = v > largest ? v : largest;
  }
  return largest;
}

static void DepthResiduals(const uint32_t* RESTRICT above, const uint32_t* RESTRICT row, size_t n, uint32_t* RESTRICT z,
                           uint8_t* RESTRICT tokens) {
  for (size_t x = 0; x < n; ++x) {
    const uint32_t folded = Fold24(row[x] - row[x - 1] - above[x] + above[x - 1]);
    z[x] = folded;
    const float v = static_cast<float>(static_cast<int32_t>(folded + 8));
    tokens[x] = static_cast<uint8_t>((std::bit_cast<uint32_t>(v) >> 20) - 1040);
  }
}

static void DepthRows(const uint32_t* RESTRICT above, const uint32_t* RESTRICT z, size_t n, uint32_t* RESTRICT row) {
  uint32_t difference = row[-1] - above[-1];
  for (size_t x = 0; x < n; ++x) {
    difference += (z[x] >> 1) ^ (0 - (z[x] & 1));
    row[x] = (above[x] + difference) & 0xFFFFFF;
  }
}

// A token if `off`, two more than how far a pixel lies from plane k, says that it lies there; else the one before.
static inline uint32_t Hit(uint32_t before, uint32_t k, uint32_t off) {
  const uint32_t near = off & 0xFFFFFF;
  const uint32_t hit = 0 - static_cast<uint32_t>(near < 5);
  return (before & ~hit) | ((5 * k + near) & hit);
}

// Planes are tried from the first to the last, so the other way round.
static void PlaneResiduals(const uint32_t* RESTRICT above2, const uint32_t* RESTRICT above,
                           const uint32_t* RESTRICT row, size_t n, uint32_t* RESTRICT z, uint8_t* RESTRICT tokens) {
  for (size_t x = 0; x < n; ++x) {
    const uint32_t up = above[x], corner = above[x - 1], right = above[x + 1];
    const uint32_t left = row[x - 1], v = row[x] + 2, past_left = v - left, past_up = v - up;
    const uint32_t folded = Fold24(past_left - up + corner - 2);
    const float f = static_cast<float>(static_cast<int32_t>(folded + 8));
    uint32_t token = (std::bit_cast<uint32_t>(f) >> 20) - 1040 + kHits;
    token = Hit(token, 7, v - 2 * right + above2[x + 2]);
    token = Hit(token, 6, past_up - corner + above2[x - 1]);
    token = Hit(token, 5, past_up - right + above2[x + 1]);
    token = Hit(token, 4, past_left - corner + above[x - 2]);
    token = Hit(token, 3, past_up - up + above2[x]);
    token = Hit(token, 2, past_left - right + up);
    token = Hit(token, 1, past_left - left + row[x - 2]);
    token = Hit(token, 0, past_left - up + corner);
    z[x] = folded;
    tokens[x] = static_cast<uint8_t>(token);
  }
}

static void PlaneTerms(const uint32_t* RESTRICT above2, const uint32_t* RESTRICT above, const uint32_t* RESTRICT z,
                       const uint8_t* RESTRICT tokens, const uint8_t* RESTRICT cover, size_t n,
                       uint32_t* RESTRICT terms, uint32_t* RESTRICT take_left, uint32_t* RESTRICT take_slope) {
  for (size_t x = 0; x < n; ++x) {
    const uint32_t up = above[x], corner = above[x - 1], right = above[x + 1], far_corner = above[x - 2];
    const uint32_t far_up = above2[x], far_up_left = above2[x - 1], far_up_right = above2[x + 1],
                   far_right = above2[x + 2];
    const uint32_t token = tokens[x], k = token * 52 >> 8, off = token - 5 * k - 2;
    const uint32_t missed = (z[x] >> 1) ^ (0 - (z[x] & 1));
    // All are made: what is read only where it is wanted takes longer.
    const uint32_t lines[8] = {up - corner,
                               0,
                               right - up,
                               2 * up - far_up,
                               corner - far_corner,
                               up + right - far_up_right,
                               up + corner - far_up_left,
                               2 * right - far_right};
    uint32_t term = up - corner + missed;
    for (uint32_t plane = 0; plane < 8; ++plane) {
      const uint32_t here = 0 - static_cast<uint32_t>(k == plane);
      term ^= (term ^ (lines[plane] + off)) & here;
    }
    terms[x] = term;
    const uint32_t by_row = k == 3 ? ~0u : 0u, later = k - 5 < 3 ? ~0u : 0u;
    take_left[x] = ~(by_row | later);
    take_slope[x] = k == 1 ? ~0u : 0u;
  }
  if (cover == nullptr) return;
  for (size_t x = 0; x < n; ++x) {
    const uint32_t covered = Wide(cover[x]), next = above[x] - above[x - 1];
    terms[x] = next ^ ((terms[x] ^ next) & covered);
    take_left[x] |= ~covered;
    take_slope[x] &= covered;
  }
}

static void PlaneKinds(const uint8_t* RESTRICT tokens, size_t n, uint8_t* RESTRICT kinds) {
  for (size_t x = 0; x < n; ++x) {
    const uint16_t t = tokens[x];
    const uint16_t hit = static_cast<uint16_t>(t * 52 >> 8), missed = Least(15, static_cast<uint16_t>((t + 88) >> 4));
    kinds[x] = static_cast<uint8_t>(t < kHits ? hit : missed);
  }
}

static void PlaneContexts(const uint8_t* RESTRICT above, size_t n, int merges, uint8_t* RESTRICT contexts) {
  for (size_t x = 0; x < n; ++x)
    contexts[x] = static_cast<uint8_t>(kPlaneContexts[static_cast<size_t>(above[x] * 16 + above[x + 1])] >> merges);
}

static void Contexts(const ContextRows& rows, size_t n, ContextScale scale, uint8_t* RESTRICT contexts) {
  const uint8_t *RESTRICT a = rows.above, *RESTRICT b = rows.above2, *RESTRICT o = rows.other;
  const int16_t bias = static_cast<int16_t>(scale.bias);
  const int shift = scale.shift, merges = scale.merges;
  const auto one = [&](int sum) {
    int16_t c = static_cast<int16_t>(static_cast<int16_t>(sum - bias) >> shift);
    c = c < 0 ? int16_t{0} : c;
    return static_cast<uint8_t>((c > 15 ? int16_t{15} : c) >> merges);
  };
  if (o == nullptr)
    for (size_t x = 0; x < n; ++x)
      contexts[x] = one(static_cast<int16_t>(3 * a[x] + 2 * a[x - 1] + 2 * a[x + 1] + b[x]));
  else
    for (size_t x = 0; x < n; ++x)
      contexts[x] = one(
          static_cast<int16_t>(3 * a[x] + 2 * a[x - 1] + 2 * a[x + 1] + b[x] + 4 * o[x] + 2 * o[x - 1] + 2 * o[x + 1]));
}

static void JoinBytes(const uint8_t* RESTRICT low, const uint8_t* RESTRICT high, size_t n, uint16_t* RESTRICT out) {
  for (size_t x = 0; x < n; ++x) out[x] = static_cast<uint16_t>(low[x] | high[x] << 8);
}

static uint32_t OtherNormals(const uint8_t* RESTRICT cover, const uint16_t* RESTRICT codes, size_t n) {
  uint16_t any = 0;
  for (size_t i = 0; i < n; ++i) {
    const uint16_t x = codes[i] & 255, y = codes[i] >> 8;
    const uint16_t side = (x == 0) | (x == 254), end = (y == 0) | (y == 254);
    const uint16_t covered = cover != nullptr ? Short(cover[i]) : uint16_t{0xFFFF};
    any |= static_cast<uint16_t>(((x == 255) | (y == 255) | (side & (y < 127)) | (end & (x < 127))) & covered);
  }
  return any;
}

// A point of the octahedron's lattice.
struct LatticePoint {
  int16_t x, y, z;
};

static inline int16_t Size16(int16_t v) { return static_cast<int16_t>(v < 0 ? -v : v); }
static inline int16_t Signed16(int16_t size, int16_t by) { return static_cast<int16_t>(by < 0 ? -size : size); }

static inline LatticePoint PointAt(int16_t x, int16_t y) {
  const int16_t z = static_cast<int16_t>(127 - Size16(x) - Size16(y));
  const int16_t fold = static_cast<int16_t>(z < 0 ? -z : 0);
  return {static_cast<int16_t>(x - Signed16(fold, x)), static_cast<int16_t>(y - Signed16(fold, y)), z};
}

// Its canonical coordinates, 0 to 254.
static inline LatticePoint CodeAt(LatticePoint p) {
  const int16_t x = Signed16(static_cast<int16_t>(127 - Size16(p.y)), p.x),
                y = Signed16(static_cast<int16_t>(127 - Size16(p.x)), p.y);
  return {static_cast<int16_t>((p.z < 0 ? x : p.x) + 127), static_cast<int16_t>((p.z < 0 ? y : p.y) + 127), 0};
}

static void TurnNormals(const uint16_t* RESTRICT codes, size_t n, int pole, int16_t* RESTRICT xs,
                        int16_t* RESTRICT ys) {
  const int16_t negated = static_cast<int16_t>(-(pole & 1));
  const auto run = [&](auto turn) {
    for (size_t i = 0; i < n; ++i) {
      const uint16_t x = codes[i] & 255, y = codes[i] >> 8;
      LatticePoint p =
          turn(PointAt(static_cast<int16_t>(Least(x, 254) - 127), static_cast<int16_t>(Least(y, 254) - 127)));
      p.z = static_cast<int16_t>((p.z ^ negated) - negated);
      const LatticePoint code = CodeAt(p);
      xs[i] = static_cast<int16_t>(code.x * 64), ys[i] = static_cast<int16_t>(code.y * 64);
    }
  };
  if (pole < 2)
    run([](LatticePoint p) { return LatticePoint{p.y, p.z, p.x}; });
  else if (pole < 4)
    run([](LatticePoint p) { return LatticePoint{p.z, p.x, p.y}; });
  else
    run([](LatticePoint p) { return p; });
}

static void TurnNormalsBack(const int16_t* RESTRICT xs, const int16_t* RESTRICT ys, size_t n, int pole,
                            uint16_t* RESTRICT codes) {
  const int16_t negated = static_cast<int16_t>(-(pole & 1));
  const auto run = [&](auto turn) {
    for (size_t i = 0; i < n; ++i) {
      const uint16_t x = static_cast<uint16_t>(xs[i] >> 6), y = static_cast<uint16_t>(ys[i] >> 6);
      LatticePoint p = PointAt(static_cast<int16_t>(Least(x, 254) - 127), static_cast<int16_t>(Least(y, 254) - 127));
      p.z = static_cast<int16_t>((p.z ^ negated) - negated);
      const LatticePoint code = CodeAt(turn(p));
      codes[i] = static_cast<uint16_t>(code.x | code.y << 8);
    }
  };
  if (pole < 2)
    run([](LatticePoint p) { return LatticePoint{p.z, p.x, p.y}; });
  else if (pole < 4)
    run([](LatticePoint p) { return LatticePoint{p.y, p.z, p.x}; });
  else
    run([](LatticePoint p) { return p; });
}

static void Divide(int16_t* row, size_t n, int offset, uint32_t share) {
  for (size_t x = 0; x < n; ++x) {
    const int v = row[x] + offset;
    row[x] = static_cast<int16_t>(static_cast<uint32_t>(v < 0 ? 0 : v) * share >> 18);
  }
}

static void UnfoldBytes(const uint8_t* RESTRICT z, size_t n, int16_t* RESTRICT out) {
  for (size_t x = 0; x < n; ++x) {
    const int16_t v = z[x];
    out[x] = static_cast<int16_t>(static_cast<int16_t>((v >> 1) ^ -(v & 1)) * 64);
  }
}

static void UnfoldWide(const uint32_t* RESTRICT z, size_t n, int bits, int16_t* RESTRICT out) {
  for (size_t x = 0; x < n; ++x) out[x] = static_cast<int16_t>(((z[x] >> 1) ^ (0 - (z[x] & 1))) << bits);
}

static void MedianResiduals(const uint8_t* RESTRICT above, const uint8_t* RESTRICT row, size_t n, uint8_t* RESTRICT z,
                            uint8_t* RESTRICT tokens) {
  for (size_t x = 0; x < n; ++x) {
    const uint8_t left = row[x - 1], up = above[x], corner = above[x - 1];
    const uint8_t low = left < up ? left : up, high = left < up ? up : left;
    const uint8_t raised = corner < low ? low : corner, clamped = raised > high ? high : raised;
    const uint8_t r = static_cast<uint8_t>(row[x] - static_cast<uint8_t>(left + up - clamped));
    const uint8_t folded = static_cast<uint8_t>((r << 1) ^ (r & 0x80 ? 0xFF : 0));
    z[x] = folded;
    tokens[x] = ByteToken(folded);
  }
}

static inline int32_t Within16(int32_t v) { return v < -32767 ? -32767 : v > 32767 ? 32767 : v; }

static void Flatness(const uint32_t* RESTRICT above2, const uint32_t* RESTRICT above, const uint32_t* RESTRICT row,
                     size_t n, uint32_t limit, uint8_t* RESTRICT out) {
  const uint32_t less = limit - 1;
  const auto within = [&](uint32_t off) { return static_cast<uint32_t>(off + less <= 2 * less); };
  for (size_t x = 0; x < n; ++x) {
    const uint32_t here = row[x], left = row[x - 1], up = above[x];
    out[x] = static_cast<uint8_t>(within(here - left - up + above[x - 1]) | within(here - 2 * left + row[x - 2]) << 1 |
                                  within(here - 2 * up + above2[x]) << 2);
  }
}

static constexpr int kOwnWeight = 1 << 13;  // of a plane's own residuals

static void AddOwnResiduals(const GuidedRows& rows, size_t n, int32_t* RESTRICT sums) {
  const int16_t* RESTRICT residual = rows.own_residual;
  if (residual == nullptr) return;
  for (size_t x = 0; x < n; ++x) sums[x] += residual[x] * kOwnWeight;
}

static void SumsByFlatness(const GuidedRows& rows, size_t n, int32_t* RESTRICT sums, bool with_left) {
  const int16_t *RESTRICT up = rows.above, *RESTRICT own = rows.own;
  for (size_t x = 0; x < n; ++x) {
    const int16_t* const w = rows.weights[rows.flatness[x]];
    int32_t sum = rows.constant + w[1] * up[x] + w[2] * up[x - 1] + w[3] * up[x + 1] + w[kFarAbove] * rows.above2[x];
    for (int i = 0; i < 9; ++i) sum += w[4 + i] * (rows.guide[i / 3] + x)[i % 3 - 1];
    if (rows.residual != nullptr) sum += w[13] * rows.residual[x];
    if (with_left) sum += w[0] * own[x - 1] + w[kFarLeft] * own[x - 2];
    sums[x] = sum;
  }
  AddOwnResiduals(rows, n, sums);
}

static void GuidedSums(const GuidedRows& rows, size_t n, int32_t* RESTRICT sums, bool with_left) {
  if (rows.flatness != nullptr) return SumsByFlatness(rows, n, sums, with_left);
  const int16_t *RESTRICT up = rows.above, *RESTRICT g0 = rows.guide[0], *RESTRICT g1 = rows.guide[1],
                          *RESTRICT g2 = rows.guide[2], *RESTRICT other = rows.residual;
  int32_t w[kGuidedTerms];
  for (int i = 0; i < kGuidedTerms; ++i) w[i] = rows.weights[0][i];
  const int32_t constant = rows.constant;
  for (size_t x = 0; x < n; ++x)
    sums[x] = constant + w[1] * up[x] + w[2] * up[x - 1] + w[3] * up[x + 1] + w[4] * g0[x - 1] + w[5] * g0[x] +
              w[6] * g0[x + 1] + w[7] * g1[x - 1] + w[8] * g1[x] + w[9] * g1[x + 1] + w[10] * g2[x - 1] +
              w[11] * g2[x] + w[12] * g2[x + 1];
  if (other != nullptr)
    for (size_t x = 0; x < n; ++x) sums[x] += w[13] * other[x];
  AddOwnResiduals(rows, n, sums);
}

static inline int32_t Guess(int32_t sum, int bits, int32_t most) {
  const int32_t p = (sum + (1 << (bits + 12))) >> (bits + 13);
  return p < 0 ? 0 : p > most ? most : p;
}

static constexpr size_t kPart = 256;

static GuidedRows PartOf(const GuidedRows& rows, size_t begin) {
  GuidedRows part = rows;
  part.own += begin, part.above += begin, part.above2 += begin;
  for (auto& g : part.guide) g += begin;
  if (part.residual != nullptr) part.residual += begin;
  if (part.own_residual != nullptr) part.own_residual += begin;
  if (part.flatness != nullptr) part.flatness += begin;
  return part;
}

using SumsOf = void (*)(const GuidedRows& rows, size_t n, int32_t* sums, bool with_left);

template <SumsOf kSums>
static void GuidedResiduals(const GuidedRows& rows, size_t n, uint8_t* RESTRICT z, uint8_t* RESTRICT tokens,
                            int16_t* RESTRICT residual) {
  int32_t sums[kPart + 32];  // to the end of a vector
  for (size_t begin = 0; begin < n; begin += kPart) {
    const size_t count = n - begin < kPart ? n - begin : kPart;
    const GuidedRows part = PartOf(rows, begin);
    kSums(part, count, sums, part.flatness != nullptr);
    const int16_t* RESTRICT own = part.own;
    const int32_t left = part.flatness != nullptr ? 0 : part.weights[0][0], most = part.most;
    uint8_t *RESTRICT zp = z + begin, *RESTRICT tp = tokens + begin;
    int16_t* RESTRICT rp = residual + begin;
    for (size_t x = 0; x < count; ++x) {
      const int32_t guess = Guess(sums[x] + left * own[x - 1], 6, most);
      const int8_t r = static_cast<int8_t>((own[x] >> 6) - guess);
      rp[x] = static_cast<int16_t>(r * 64);
      const uint8_t folded = static_cast<uint8_t>((r << 1) ^ (r >> 7));
      zp[x] = folded;
      tp[x] = ByteToken(folded);
    }
  }
}

template <SumsOf kSums>
static void GuidedResidualsWide(const GuidedRows& rows, size_t n, uint32_t* RESTRICT z, uint8_t* RESTRICT tokens,
                                int16_t* RESTRICT residual) {
  int32_t sums[kPart + 32];  // to the end of a vector
  for (size_t begin = 0; begin < n; begin += kPart) {
    const size_t count = n - begin < kPart ? n - begin : kPart;
    const GuidedRows part = PartOf(rows, begin);
    kSums(part, count, sums, false);
    const int16_t* RESTRICT own = part.own;
    const int32_t left = part.weights[0][0], most = part.most;
    const int bits = part.bits;
    uint32_t* RESTRICT zp = z + begin;
    uint8_t* RESTRICT tp = tokens + begin;
    int16_t* RESTRICT rp = residual + begin;
    for (size_t x = 0; x < count; ++x) {
      const int32_t r = (own[x] >> bits) - Guess(sums[x] + left * own[x - 1], bits, most);
      rp[x] = static_cast<int16_t>(r * (1 << bits));
      zp[x] = static_cast<uint32_t>((r << 1) ^ (r >> 31));
      const float v = static_cast<float>(static_cast<int32_t>(zp[x] + 8));
      tp[x] = static_cast<uint8_t>((std::bit_cast<uint32_t>(v) >> 20) - 1040);
    }
  }
}

static void MedianValues(const int16_t* RESTRICT above, const int16_t* RESTRICT row, size_t n, uint8_t* RESTRICT z,
                         uint8_t* RESTRICT tokens, int16_t* RESTRICT residual) {
  for (size_t x = 0; x < n; ++x) {
    const int16_t left = row[x - 1], up = above[x], corner = above[x - 1];
    const int16_t low = left < up ? left : up, high = left < up ? up : left;
    const int16_t raised = corner < low ? low : corner, clamped = raised > high ? high : raised;
    // 64ths mod 256: the upper two bits fall out.
    const int16_t off = static_cast<int16_t>(static_cast<uint16_t>(row[x] - left - up + clamped) << 2);
    residual[x] = static_cast<int16_t>(off >> 2);
    const uint8_t folded = static_cast<uint8_t>((off >> 7) ^ (off >> 15));
    z[x] = folded;
    tokens[x] = ByteToken(folded);
  }
}

// A quotient below 1 in 2^-14, of a numerator and a depth code.
static void Heights(const uint32_t* RESTRICT depth, size_t n, int x0, int y, const HeightModel& model,
                    int16_t* RESTRICT out) {
  const uint32_t row = static_cast<uint32_t>(model.b) * static_cast<uint32_t>(y) + static_cast<uint32_t>(model.c);
  const uint32_t base = static_cast<uint32_t>(model.base);
  const int32_t low = model.low, scale = model.scale;
  const uint32_t first = row + static_cast<uint32_t>(model.a) * static_cast<uint32_t>(x0);
  for (size_t x = 0; x < n; ++x) {
    const int32_t code = static_cast<int32_t>(depth[x] & 0xFFFFFF);
    const int32_t sum = static_cast<int32_t>(first + static_cast<uint32_t>(model.a) * static_cast<uint32_t>(x) -
                                             base * static_cast<uint32_t>(code));
    int32_t size = sum < 0 ? ~sum : sum;
    size = size < code ? size : code;
    const int32_t up = 23 - static_cast<int32_t>((std::bit_cast<uint32_t>(static_cast<float>(code | 1)) >> 23) - 127);
    const int32_t d = static_cast<int32_t>(static_cast<uint32_t>(code) << up >> 9 | 0x4000);
    int32_t r = 46260 - (d * 30840 >> 15);
    r = (r * (32768 - (d * r >> 15))) >> 14;
    r = (r * (32768 - (d * r >> 15))) >> 14;
    const uint32_t quotient = (static_cast<uint32_t>(size) << up >> 8) * static_cast<uint32_t>(r) >> 16;
    const int32_t height = sum < 0 ? -static_cast<int32_t>(quotient) : static_cast<int32_t>(quotient);
    const int32_t t = (Within16(height - low) * scale) >> 12;
    out[x] = static_cast<int16_t>(t < 0 ? 0 : t > 16383 ? 16383 : t);
  }
}

static void Knots(const HeightModel& model, size_t n, int16_t* RESTRICT row) {
  for (size_t x = 0; x < n; ++x) {
    const int32_t i = row[x] >> 8, a = model.knots[i], b = model.knots[i + 1];
    row[x] = static_cast<int16_t>(a + ((b - a) * (row[x] & 255) >> 8));
  }
}

// Slopes of the reciprocal depth at a pixel, and what it would be at the tile's centre, are linear in the surface's
// normal, whatever the camera (docs/codec.md). 31-bit integers; the quotient by Newton's method.
static void Geometry(const uint32_t* const depth[3], size_t n, int x0, int y, const GeometryModel& model,
                     int16_t* RESTRICT gx, int16_t* RESTRICT gy) {
  const uint32_t *RESTRICT above = depth[0], *RESTRICT here = depth[1], *RESTRICT below = depth[2];
  int32_t a[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) a[i][j] = model.matrix[i][j];
  const int slope_shift = model.slope_shift, height_shift = model.height_shift;
  for (size_t x = 0; x < n; ++x) {
    const int32_t u = Within16(static_cast<int32_t>(here[x + 1] - here[x - 1]) >> slope_shift),
                  v = Within16(static_cast<int32_t>(below[x] - above[x]) >> slope_shift);
    const uint32_t px = static_cast<uint32_t>(x0 + static_cast<int>(x)), py = static_cast<uint32_t>(y);
    const int32_t height =
        static_cast<int32_t>(static_cast<uint32_t>(static_cast<int32_t>(here[x] << 1) >> slope_shift) -
                             px * static_cast<uint32_t>(u) - py * static_cast<uint32_t>(v));
    const int32_t h = Within16(height >> height_shift);
    const int32_t mx = a[0][0] * u + a[0][1] * v + a[0][2] * h, my = a[1][0] * u + a[1][1] * v + a[1][2] * h,
                  mz = a[2][0] * u + a[2][1] * v + a[2][2] * h;
    const int32_t absx = mx < 0 ? -mx : mx, absy = my < 0 ? -my : my, absz = mz < 0 ? -mz : mz;
    const int32_t s = absx + absy + absz;
    const float f = static_cast<float>(s >> 6 | 1);  // below 2^24, so exact: its exponent is wanted
    const int32_t up = 24 - static_cast<int32_t>((std::bit_cast<uint32_t>(f) >> 23) - 127);
    const int32_t d = static_cast<int32_t>(static_cast<uint32_t>(s) << up >> 16 | 0x4000);
    int32_t r = 46260 - (d * 30840 >> 15);
    r = (r * (32768 - (d * r >> 15))) >> 14;
    r = (r * (32768 - (d * r >> 15))) >> 14;
    const int32_t nx = static_cast<int32_t>(static_cast<uint32_t>(mx) << up) >> 16,
                  ny = static_cast<int32_t>(static_cast<uint32_t>(my) << up) >> 16;
    int32_t qx = (nx * r >> 15) * 127 >> 8, qy = (ny * r >> 15) * 127 >> 8;
    const int32_t ax = qx < 0 ? -qx : qx, ay = qy < 0 ? -qy : qy;
    const int32_t fx = qx < 0 ? ay - 8128 : 8128 - ay, fy = qy < 0 ? ax - 8128 : 8128 - ax;
    qx = mz < 0 ? fx : qx, qy = mz < 0 ? fy : qy;
    gx[x] = static_cast<int16_t>(qx + 8128);
    gy[x] = static_cast<int16_t>(qy + 8128);
  }
}

static void Activity(const int16_t* const gx[3], const int16_t* const gy[3], size_t n, uint8_t* RESTRICT tokens) {
  for (size_t x = 0; x < n; ++x) {
    const auto far = [&](int a, int b) { return a < b ? b - a : a - b; };
    const int sum = far(gx[1][x + 1], gx[1][x - 1]) + far(gx[2][x], gx[0][x]) + far(gy[1][x + 1], gy[1][x - 1]) +
                    far(gy[2][x], gy[0][x]);
    const float v = static_cast<float>((sum >> 3) + 8);
    tokens[x] = static_cast<uint8_t>((std::bit_cast<uint32_t>(v) >> 20) - 1040);
  }
}
