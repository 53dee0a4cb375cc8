// What vectors make of rows is what the plain loops make of them, on every instruction set, whatever the rows hold.
#include "common/codec/dense/kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "common/codec/dense/fit.h"
#include "common/codec/dense/plane.h"
#include "tests/support/simd_targets.h"

namespace telesplat::codec::detail {
namespace {

using testing::OnTarget;

constexpr size_t kWidths[] = {1, 16, 31, 64, 65, 100, 200, 256, 331};

std::string name_of(int64_t target, size_t width) { return hwy::TargetName(target) + (" " + std::to_string(width)); }

// Calls check(kernels, width, random) for each instruction set and width; `random` starts alike for all sets.
template <class Check>
void on_every_set(Check check) {
  for (const int64_t target : kernel_targets()) {
    const OnTarget on(target);
    std::mt19937 random(5);
    for (const size_t width : kWidths) {
      SCOPED_TRACE(name_of(target, width));
      for (int round = 0; round < 20; ++round) ASSERT_NO_FATAL_FAILURE(check(kernels(), width, random));
    }
  }
}

// In sanitized builds as well: they are what decodes the streams of others.
TEST(Kernels, EveryInstructionSetOfThisMachineIsTested) {
  const std::vector<int64_t> all = kernel_targets();
  for (const int64_t target : {int64_t{HWY_AVX2}, int64_t{HWY_AVX3}, int64_t{HWY_AVX3_DL}})
    if (hwy::SupportedTargets() & target) {
      EXPECT_EQ(std::count(all.begin(), all.end(), target), 1) << hwy::TargetName(target);
    }
}

// Three rows of a plane and what is around them.
template <class T, class Value>
Plane<T> rows_of(size_t width, Value value) {
  Plane<T> plane;
  plane.reset(width, 3);
  for (ptrdiff_t y = -2; y < 5; ++y)
    for (ptrdiff_t x = -static_cast<ptrdiff_t>(Plane<T>::kLead); x < static_cast<ptrdiff_t>(width + Plane<T>::kTail);
         ++x)
      plane.row(y)[x] = static_cast<T>(value());
  return plane;
}

template <class T>
std::vector<T> row_for(size_t width) {
  return std::vector<T>(width + Plane<T>::kTail);
}

template <class T>
void expect_same(const std::vector<T>& a, const std::vector<T>& b, size_t width) {
  for (size_t x = 0; x < width; ++x) ASSERT_EQ(a[x], b[x]) << x;
}

TEST(Kernels, ContextsAreThoseOfThePage) {
  on_every_set([](const Kernels& set, size_t width, std::mt19937& random) {
    const auto tokens = rows_of<uint8_t>(width, [&] { return random() % 4 == 0 ? random() % kNumberTokens : 3; });
    const ContextRows rows{tokens.row(0), tokens.row(-1), random() % 2 != 0 ? tokens.row(1) : nullptr};
    const ContextScale scale{static_cast<int>(random() % 900), static_cast<int>(random() % 15),
                             static_cast<int>(random() % 5)};
    auto a = row_for<uint8_t>(width), b = a;
    set.contexts(rows, width, scale, a.data());
    plain_kernels().contexts(rows, width, scale, b.data());
    expect_same(a, b, width);
    auto c = row_for<uint16_t>(width);
    set.join_bytes(tokens.row(0), a.data(), width, c.data());
    for (size_t x = 0; x < width; ++x) ASSERT_EQ(c[x], tokens.row(0)[x] + 256 * a[x]);
  });
}

// Values and a guide from 0 to `most`, residuals, and weights whose sizes add up to what is allowed.
struct Guided {
  Guided(size_t width, int bits, int largest, std::mt19937& random) : most(largest) {
    const auto value = [&] { return (static_cast<int>(random() % static_cast<uint32_t>(most + 1))) << bits; };
    own = rows_of<int16_t>(width, value);
    guide = rows_of<int16_t>(width, [&] { return random() % static_cast<uint32_t>((most << bits) + 1); });
    residual = rows_of<int16_t>(width, [&] { return static_cast<int>(random() % 256 - 128) * 64; });
    flatness = rows_of<uint8_t>(width, [&] { return random() % kFlatnesses; });
    for (auto& set : weights)
      for (int16_t& w : set)
        w = static_cast<int16_t>(static_cast<int>(random() % (kMostWeight / 8)) - kMostWeight / 16);
    constant = static_cast<int32_t>(random() % (2 * kMostConstant)) - kMostConstant;
  }
  GuidedRows rows(int bits, bool flat, bool other) const {
    return {.own = own.row(1),
            .above = own.row(0),
            .above2 = own.row(-1),
            .guide = {guide.row(0), guide.row(1), guide.row(2)},
            .residual = other ? residual.row(0) : nullptr,
            .own_residual = nullptr,
            .flatness = flat ? flatness.row(0) : nullptr,
            .weights = weights,
            .constant = constant,
            .bits = bits,
            .most = most};
  }
  int most;
  Plane<int16_t> own, guide, residual;
  Plane<uint8_t> flatness;
  int16_t weights[kFlatnesses][kGuidedTerms];
  int32_t constant;
};

TEST(Kernels, GuidedPredictionIsThatOfThePage) {
  on_every_set([](const Kernels& set, size_t width, std::mt19937& random) {
    const Guided guided(width, 6, 254, random);
    for (const bool flat : {false, true})
      for (const bool other : {false, true}) {
        GuidedRows rows = guided.rows(6, flat, other);
        auto z = row_for<uint8_t>(width), plain_z = z, tokens = z, plain_tokens = z;
        auto off = row_for<int16_t>(width), plain_off = off;
        set.guided_residuals(rows, width, z.data(), tokens.data(), off.data());
        plain_kernels().guided_residuals(rows, width, plain_z.data(), plain_tokens.data(), plain_off.data());
        expect_same(z, plain_z, width), expect_same(tokens, plain_tokens, width), expect_same(off, plain_off, width);
        auto sums = row_for<int32_t>(width), plain_sums = sums;
        for (const bool own : {false, true}) {
          rows.own_residual = own ? guided.residual.row(2) : nullptr;
          set.guided_sums(rows, width, sums.data(), false);
          plain_kernels().guided_sums(rows, width, plain_sums.data(), false);
          expect_same(sums, plain_sums, width);
        }
      }
  });
}

TEST(Kernels, IndicesArePredictedAsThePageSays) {
  on_every_set([](const Kernels& set, size_t width, std::mt19937& random) {
    const Guided guided(width, 4, 1 + static_cast<int>(random() % 1023), random);
    const GuidedRows rows = guided.rows(4, false, false);
    auto z = row_for<uint32_t>(width), plain_z = z;
    auto tokens = row_for<uint8_t>(width), plain_tokens = tokens;
    auto off = row_for<int16_t>(width), plain_off = off, back = off;
    set.guided_residuals_wide(rows, width, z.data(), tokens.data(), off.data());
    plain_kernels().guided_residuals_wide(rows, width, plain_z.data(), plain_tokens.data(), plain_off.data());
    expect_same(z, plain_z, width), expect_same(tokens, plain_tokens, width), expect_same(off, plain_off, width);
    set.unfold_wide(z.data(), width, 4, back.data());
    expect_same(back, off, width);
  });
}

TEST(Kernels, DirectionsAreThoseOfThePage) {
  on_every_set([](const Kernels& set, size_t width, std::mt19937& random) {
    const uint32_t rough = random() % 25;
    const auto depth = rows_of<uint32_t>(width, [&] { return (1u << 23) + random() % (1u << rough); });
    const uint32_t* const rows[3] = {depth.row(0), depth.row(1), depth.row(2)};
    GeometryModel model;
    for (auto& row : model.matrix)
      for (int16_t& e : row) e = static_cast<int16_t>(static_cast<int>(random() % 7000) - 3500);
    if (random() % 9 == 0) model = {};
    model.slope_shift = static_cast<int>(random() % 16), model.height_shift = static_cast<int>(random() % 16);
    const int x0 = static_cast<int>(random() % (65536 - width)) - 32768, y = static_cast<int>(random() % 256) - 128;
    auto gx = row_for<int16_t>(width), gy = gx, plain_gx = gx, plain_gy = gx;
    set.geometry(rows, width, x0, y, model, gx.data(), gy.data());
    plain_kernels().geometry(rows, width, x0, y, model, plain_gx.data(), plain_gy.data());
    expect_same(gx, plain_gx, width), expect_same(gy, plain_gy, width);
  });
}

TEST(Kernels, ActivityIsThatOfThePage) {
  on_every_set([](const Kernels& set, size_t width, std::mt19937& random) {
    const uint32_t rough = random() % 15;
    const auto value = [&] {
      return random() % 99 == 0 ? 254 * 64 : random() % ((1u << rough) - (rough == 14 ? 128 : 0));
    };
    const auto x = rows_of<int16_t>(width, value), y = rows_of<int16_t>(width, value);
    const int16_t *const xs[3] = {x.row(0), x.row(1), x.row(2)}, *const ys[3] = {y.row(0), y.row(1), y.row(2)};
    auto tokens = row_for<uint8_t>(width), plain = tokens;
    set.activity(xs, ys, width, tokens.data());
    plain_kernels().activity(xs, ys, width, plain.data());
    expect_same(tokens, plain, width);
  });
}

TEST(Kernels, SlotsAreThoseOfEachToken) {
  on_every_set([](const Kernels& set, size_t width, std::mt19937& random) {
    std::vector<uint16_t> frequencies(std::min<size_t>(width, kSymbols));
    uint32_t left = kFrequencyOne;
    for (uint16_t& f : frequencies) {
      f = static_cast<uint16_t>(random() % 3 == 0 ? 0 : random() % 9 == 0 ? random() % (left + 1) : std::min(left, 2u));
      left -= f;
    }
    frequencies.back() = static_cast<uint16_t>(frequencies.back() + left);
    std::vector<uint32_t> slots(kFrequencyOne + kMoreSlots);
    ASSERT_EQ(set.slots(frequencies.data(), static_cast<unsigned>(frequencies.size()), slots.data()),
              slots.data() + kFrequencyOne);
    size_t at = 0;
    for (uint32_t t = 0; t < frequencies.size(); ++t)
      for (uint32_t i = 0; i < frequencies[t]; ++i, ++at)
        ASSERT_EQ(slots[at], t << 24 | (frequencies[t] - 1u) << 12 | i) << at;
  });
}

TEST(Kernels, HeightsAreThoseOfThePage) {
  on_every_set([](const Kernels& set, size_t width, std::mt19937& random) {
    const uint32_t least = random() % 3 == 0 ? 0 : 1u << random() % 24, rough = random() % 24;
    const auto depth = rows_of<uint32_t>(width, [&] { return least + random() % (1u << rough); });
    HeightModel model;
    model.a = static_cast<int32_t>(random() >> random() % 24),
    model.b = static_cast<int32_t>(random() >> random() % 24);
    model.c = static_cast<int32_t>(random()), model.base = static_cast<int32_t>(random() % 3) - 1;
    model.low = static_cast<int32_t>(random() % 65536) - 32768, model.scale = static_cast<int32_t>(random() % 65536);
    for (int16_t& knot : model.knots) knot = static_cast<int16_t>(random() % 16384);
    auto row = row_for<int16_t>(width), plain = row;
    set.heights(depth.row(0), width, -100, 7, model, row.data());
    plain_kernels().heights(depth.row(0), width, -100, 7, model, plain.data());
    expect_same(row, plain, width);
    set.knots(model, width, row.data());
    plain_kernels().knots(model, width, plain.data());
    expect_same(row, plain, width);
  });
}

// Depth of facets: most pixels lie in one of eight planes, or up to three codes beside it.
Plane<uint32_t> facets(size_t width, std::mt19937& random) {
  auto depth = rows_of<uint32_t>(width, [&] { return (1u << 22) + random() % 64; });
  if (random() % 4 == 0) return depth;
  for (ptrdiff_t x = 2; x < static_cast<ptrdiff_t>(width); ++x) {
    uint32_t *const row = depth.row(1), *const up = depth.row(0), *const far = depth.row(-1);
    const uint32_t planes[8] = {row[x - 1] + up[x] - up[x - 1],     2 * row[x - 1] - row[x - 2],
                                row[x - 1] + up[x + 1] - up[x],     2 * up[x] - far[x],
                                row[x - 1] + up[x - 1] - up[x - 2], up[x] + up[x + 1] - far[x + 1],
                                up[x] + up[x - 1] - far[x - 1],     2 * up[x + 1] - far[x + 2]};
    row[x] = planes[random() % 8] + random() % 7 - 3;
  }
  return depth;
}

TEST(Kernels, PlanesAreThoseOfThePage) {
  on_every_set([](const Kernels& set, size_t width, std::mt19937& random) {
    const auto depth = facets(width, random);
    auto z = row_for<uint32_t>(width), plain_z = z;
    auto tokens = row_for<uint8_t>(width), plain_tokens = tokens, cover = tokens;
    set.plane_residuals(depth.row(-1), depth.row(0), depth.row(1), width, z.data(), tokens.data());
    plain_kernels().plane_residuals(depth.row(-1), depth.row(0), depth.row(1), width, plain_z.data(),
                                    plain_tokens.data());
    expect_same(z, plain_z, width), expect_same(tokens, plain_tokens, width);
    for (uint8_t& c : cover) c = random() % 3 == 0 ? 0 : 255;
    const uint8_t* const covered = random() % 3 == 0 ? nullptr : cover.data();
    auto terms = row_for<uint32_t>(width), left = terms, slope = terms, plain_terms = terms, plain_left = terms,
         plain_slope = terms;
    set.plane_terms(depth.row(-1), depth.row(0), z.data(), tokens.data(), covered, width, terms.data(), left.data(),
                    slope.data());
    plain_kernels().plane_terms(depth.row(-1), depth.row(0), z.data(), tokens.data(), covered, width,
                                plain_terms.data(), plain_left.data(), plain_slope.data());
    expect_same(terms, plain_terms, width), expect_same(left, plain_left, width);
    expect_same(slope, plain_slope, width);
  });
}

TEST(Kernels, PlanesContextsAreThoseOfTheTable) {
  on_every_set([](const Kernels& set, size_t width, std::mt19937& random) {
    const auto kinds = rows_of<uint8_t>(width, [&] { return random() % 16; });
    const int merges = static_cast<int>(random() % 5);
    auto contexts = row_for<uint8_t>(width);
    set.plane_contexts(kinds.row(0), width, merges, contexts.data());
    for (size_t x = 0; x < width; ++x)
      ASSERT_EQ(contexts[x], kPlaneContexts[size_t{kinds.row(0)[x]} * 16 + kinds.row(0)[x + 1]] >> merges) << x;
  });
}

// Runs of bits that are set, of `longest` at most, and of those that are not; none from `width` on.
std::vector<uint64_t> runs_of_bits(size_t width, size_t longest, std::mt19937& random) {
  std::vector<uint64_t> words(width / 64 + 1);
  bool set = random() % 2 != 0;
  for (size_t x = 0; x < width; set = !set)
    for (size_t left = 1 + random() % longest; left > 0 && x < width; --left, ++x)
      words[x / 64] |= uint64_t{set} << x % 64;
  return words;
}

template <class T>
void expect_packed(void (*pack)(const uint64_t*, const T*, size_t, T*), const std::vector<uint64_t>& words,
                   const std::vector<T>& values, size_t width, std::vector<T>& packed) {
  packed = row_for<T>(width);
  pack(words.data(), values.data(), width, packed.data());
  size_t n = 0;
  for (size_t x = 0; x < width; ++x)
    if (words[x / 64] >> x % 64 & 1) {
      ASSERT_EQ(packed[n], values[x]) << x;
      ++n;
    }
}

TEST(Kernels, RowsWithHolesArePackedAndUnpacked) {
  on_every_set([](const Kernels& set, size_t width, std::mt19937& random) {
    const auto words = runs_of_bits(width, size_t{1} << random() % 9, random);
    auto bytes = row_for<uint8_t>(width), cover = bytes, packed_bytes = bytes, bytes_back = bytes;
    auto shorts = row_for<uint16_t>(width), packed_shorts = shorts;
    auto wide = row_for<uint32_t>(width), packed_wide = wide;
    for (uint8_t& v : bytes) v = static_cast<uint8_t>(random());
    for (uint16_t& v : shorts) v = static_cast<uint16_t>(random());
    for (uint32_t& v : wide) v = static_cast<uint32_t>(random());
    set.cover_bytes(words.data(), width, cover.data());
    ASSERT_NO_FATAL_FAILURE(expect_packed(set.pack_bytes, words, bytes, width, packed_bytes));
    ASSERT_NO_FATAL_FAILURE(expect_packed(set.pack_shorts, words, shorts, width, packed_shorts));
    ASSERT_NO_FATAL_FAILURE(expect_packed(set.pack_wide, words, wide, width, packed_wide));
    std::vector<uint32_t> wide_back(width + Plane<uint32_t>::kTail, 7);
    set.unpack_bytes(words.data(), packed_bytes.data(), width, bytes_back.data());
    set.unpack_wide(words.data(), cover.data(), packed_wide.data(), width, wide_back.data());
    for (size_t x = 0; x < width; ++x) {
      const bool covered = (words[x / 64] >> x % 64 & 1) != 0;
      ASSERT_TRUE(!covered || bytes_back[x] == bytes[x]) << x;
      ASSERT_EQ(wide_back[x], covered ? wide[x] : 0) << x;
    }
  });
}

}  // namespace
}  // namespace telesplat::codec::detail
