// The loops over rows follow docs/codec.md, for any content of the rows.
#include "common/codec/dense/kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "common/codec/dense/fit.h"
#include "common/codec/dense/plane.h"

namespace telesplat::codec::detail {
namespace {

constexpr size_t kWidths[] = {1, 16, 31, 64, 65, 100, 200, 256, 331};

// Calls check(width, random) for each width.
template <class Check>
void for_each_width(Check check) {
  std::mt19937 random(5);
  for (const size_t width : kWidths) {
    SCOPED_TRACE(width);
    for (int round = 0; round < 20; ++round) ASSERT_NO_FATAL_FAILURE(check(width, random));
  }
}

// Three rows of a plane and the values around them.
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

TEST(Kernels, FoldingComesBack) {
  for (const int32_t v : {0, -1, 1, -2, 2, 8388607, -8388608}) EXPECT_EQ(unfold(fold(v)), v);
  EXPECT_EQ(fold(-1), 1u);
  EXPECT_EQ(fold(1), 2u);
  EXPECT_EQ(fold24(0xFFFFFF), 1u) << "-1 modulo 2^24";
}

TEST(Kernels, ContextsAreThoseOfThePage) {
  for_each_width([](size_t width, std::mt19937& random) {
    const auto tokens = rows_of<uint8_t>(width, [&] { return random() % 4 == 0 ? random() % kNumberTokens : 3; });
    const ContextRows rows{tokens.row(0), tokens.row(-1), random() % 2 != 0 ? tokens.row(1) : nullptr};
    const ContextScale scale{static_cast<int>(random() % 900), static_cast<int>(random() % 15),
                             static_cast<int>(random() % 5)};
    std::vector<uint8_t> contexts(width);
    make_contexts(rows, width, scale, contexts.data());
    for (size_t x = 0; x < width; ++x)
      ASSERT_EQ(contexts[x], std::clamp((rows.sum(x) - scale.bias) >> scale.shift, 0, 15) >> scale.merges) << x;
  });
}

// With weights whose sizes add up to the limit a prediction stays within 32 bits.
TEST(Kernels, GuidedPredictionIsThatOfThePage) {
  for_each_width([](size_t width, std::mt19937& random) {
    const int bits = random() % 2 != 0 ? 6 : 4, most = bits == 6 ? 255 : 1023;
    const auto value = [&] { return static_cast<int>(random() % static_cast<uint32_t>(most + 1)) << bits; };
    const auto own = rows_of<int16_t>(width, value), guide = rows_of<int16_t>(width, value),
               other = rows_of<int16_t>(width, [&] { return static_cast<int>(random() % 256 - 128) * 64; });
    int16_t weights[kGuidedTerms];
    for (int16_t& w : weights)
      w = static_cast<int16_t>(static_cast<int>(random() % (kMostWeight / 7)) - kMostWeight / 14);
    const GuidedRows rows{.own = own.row(1),
                          .above = own.row(0),
                          .guide = {guide.row(0), guide.row(1), guide.row(2)},
                          .residual = random() % 2 != 0 ? other.row(0) : nullptr,
                          .weights = weights,
                          .constant = static_cast<int32_t>(random() % (2 * kMostConstant)) - kMostConstant,
                          .bits = bits,
                          .most = most,
                          .wraps = bits == 6};
    std::vector<int32_t> sums(width);
    std::vector<uint32_t> z(width);
    guided_sums(rows, width, sums.data());
    guided_residuals(rows, sums.data(), width, z.data());
    for (size_t i = 0; i < width; ++i) {
      const auto x = static_cast<ptrdiff_t>(i);
      int64_t sum = rows.constant + (int64_t{1} << (bits + 12));
      const int near[4] = {rows.own[x - 1], rows.above[x], rows.above[x - 1], rows.above[x + 1]};
      for (int k = 0; k < 4; ++k) sum += int64_t{weights[k]} * near[k];
      for (int k = 0; k < 9; ++k) sum += int64_t{weights[4 + k]} * rows.guide[k / 3][x + k % 3 - 1];
      if (rows.residual != nullptr) sum += int64_t{weights[kOtherResidual]} * rows.residual[x];
      int64_t off = (rows.own[x] >> bits) - std::clamp<int64_t>(sum >> (bits + 13), 0, most);
      if (rows.wraps) off = static_cast<int8_t>(off);
      ASSERT_EQ(unfold(z[i]), off) << i;
    }
  });
}

// The quotients' approximation is exact enough for the guide.
TEST(Kernels, DirectionsAreThoseOfTheMatrix) {
  for_each_width([](size_t width, std::mt19937& random) {
    const auto depth = rows_of<uint32_t>(width, [&] { return (1u << 23) + random() % (1u << 12); });
    const uint32_t* const rows[3] = {depth.row(0), depth.row(1), depth.row(2)};
    GeometryModel model;
    for (auto& row : model.matrix)
      for (int16_t& e : row) e = static_cast<int16_t>(static_cast<int>(random() % 7000) - 3500);
    model.height_shift = 10;
    std::vector<int16_t> gx(width), gy(width);
    int16_t* const guide[2] = {gx.data(), gy.data()};
    geometry(rows, width, -100, 7, model, guide);
    for (size_t i = 0; i < width; ++i) {
      const auto x = static_cast<ptrdiff_t>(i);
      const double u = static_cast<int>(depth.row(1)[x + 1] - depth.row(1)[x - 1]),
                   v = static_cast<int>(depth.row(2)[x] - depth.row(0)[x]),
                   h = std::floor((2.0 * depth.row(1)[x] - (static_cast<double>(i) - 100) * u - 7 * v) / 1024);
      double m[3], size = 0;
      for (int k = 0; k < 3; ++k)
        size += std::abs(m[k] = model.matrix[k][0] * u + model.matrix[k][1] * v + model.matrix[k][2] * h);
      if (size < 1e6) continue;
      double a = m[0] / size, b = m[1] / size;
      if (m[2] < 0) {
        const double c = (1 - std::abs(b)) * (a < 0 ? -1 : 1);
        b = (1 - std::abs(a)) * (b < 0 ? -1 : 1), a = c;
      }
      ASSERT_NEAR(gx[i], 8128 * (1 + a), 24) << i;
      ASSERT_NEAR(gy[i], 8128 * (1 + b), 24) << i;
    }
  });
}

// Depth of facets: most pixels lie in one of eight planes, or up to three codes off it.
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

TEST(Kernels, PlanesComeBack) {
  for_each_width([](size_t width, std::mt19937& random) {
    const auto depth = facets(width, random);
    const uint32_t *const far = depth.row(-1), *const up = depth.row(0), *const row = depth.row(1);
    std::vector<uint32_t> z(width), terms(width), left(width), slope(width);
    std::vector<uint8_t> tokens(width), kinds(width);
    plane_residuals(far, up, row, width, z.data(), tokens.data());
    plane_terms(far, up, z.data(), tokens.data(), width, {terms.data(), left.data(), slope.data()});
    plane_kinds(tokens.data(), width, kinds.data());
    for (size_t i = 0; i < width; ++i) {
      const auto x = static_cast<ptrdiff_t>(i);
      const uint32_t next = terms[i] + (row[x - 1] & left[i]) + ((row[x - 1] - row[x - 2]) & slope[i]);
      ASSERT_EQ(next & 0xFFFFFF, row[x]) << i;
      ASSERT_EQ(kinds[i], tokens[i] < kHits ? tokens[i] / 5u : std::min(15u, 8 + (tokens[i] - kHits) / 16)) << i;
    }
  });
}

}  // namespace
}  // namespace telesplat::codec::detail
