// Decoders of guided planes follow docs/codec.md for any weights and masks; and normals are turned by the tables.
#include "common/codec/dense/guided.h"

#include <gtest/gtest.h>

#include <random>

#include "common/codec/dense/normals.h"
#include "tests/support/masks.h"

namespace telesplat::codec::detail {
namespace {

constexpr int kWidth = 70, kHeight = 9;

// Fills a plane with weights whose sizes add up to `size`, a guide and symbols. rough: they may have any value; else
// weights cancel each other, the constant is the middle, and no value comes near its bounds.
void fill(GuidedPlane& plane, const TileShape& shape, int fraction, int most, int size, bool rough,
          std::mt19937& random) {
  plane.reset(shape, fraction, most);
  BitWriter writer;
  writer.start(GuidedPlane::kMostWeightBits);
  writer.sink.put(0, 1);
  const int each = size / (kGuidedTerms - 1);
  for (int i = 0; i < kGuidedTerms; ++i) {
    const int weight = rough ? static_cast<int>(random() % static_cast<uint32_t>(each)) : i == 12 ? 0 : each;
    const bool negative = rough ? random() % 3 == 0 : i % 2 != 0;
    writer.sink.put(static_cast<uint16_t>(negative ? -weight : weight), 16);
  }
  const int middle = (most / 2) << (13 + fraction);
  writer.sink.put(static_cast<uint32_t>((1 << 27) + (rough ? static_cast<int>(random() % (1 << 22)) : middle)), 28);
  BitReader reader;
  reader.start(writer.bytes(), 1024);
  ASSERT_TRUE(plane.get_weights(reader));
  const int largest = most << fraction;
  for (size_t y = 0; y < shape.height; ++y)
    for (size_t x = 0; x < shape.width; ++x) {
      const auto r = static_cast<ptrdiff_t>(y);
      plane.guide.row(r)[x] = static_cast<int16_t>(
          rough && random() % 9 == 0 ? random() % static_cast<uint32_t>(largest) : static_cast<uint32_t>(largest / 2));
      const uint32_t far = fraction == GuidedPlane::kByteBits ? 256 : 1 << 20;
      const uint32_t z = random() % (rough ? random() % 20 == 0 ? far : 8 : random() % 8 == 0 ? 3 : 1);
      plane.symbols.z.row(r)[x] = z;
    }
  plane.begin(shape);
}

// Computes values by docs/codec.md, "Guided prediction". residual: the plane before's, as coded; null: first plane.
std::vector<int> values_of(GuidedPlane& p, const TileShape& shape, const std::vector<int>* residual,
                           std::vector<int>& own_residual) {
  const bool byte = p.bits == GuidedPlane::kByteBits;
  const auto nearest = [&](int guide) { return std::clamp((guide + (1 << p.bits >> 1)) >> p.bits, 0, p.most); };
  const int w = static_cast<int>(shape.width), h = static_cast<int>(shape.height);
  std::vector<int> out(shape.width * shape.height);
  own_residual.assign(out.size(), 0);
  const auto at = [&](int x, int y) {
    if (x < 0 || x >= w || y < 0) return nearest(p.guide.row(std::max(y, 0))[std::clamp(x, 0, w - 1)]);
    return out[static_cast<size_t>(y * w + x)];
  };
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x)  // also pixels to the right: they predict the next row
      out[static_cast<size_t>(y * w + x)] = nearest(p.guide.row(y)[x]);
    for (int x = 0; x < w; ++x) {
      if (!shape.at(static_cast<size_t>(x), static_cast<size_t>(y))) continue;
      const auto i = static_cast<size_t>(y * w + x);
      const uint32_t z = p.symbols.z.row(y)[x];
      int off = static_cast<int>(z >> 1) ^ -static_cast<int>(z & 1);
      if (!byte) off = static_cast<int16_t>(off * (1 << p.bits)) >> p.bits;  // the range of a plane
      own_residual[i] = off;
      const int neighbours[4] = {at(x - 1, y), at(x, y - 1), at(x - 1, y - 1), at(x + 1, y - 1)};
      int64_t sum = p.constant + (int64_t{1} << (12 + p.bits));
      for (int k = 0; k < 4; ++k) sum += int64_t{p.weights[k]} * neighbours[k] * (1 << p.bits);
      for (int k = 0; k < 9; ++k) {
        const int gx = std::clamp(x + k % 3 - 1, 0, w - 1), gy = std::clamp(y + k / 3 - 1, 0, h - 1);
        sum += int64_t{p.weights[4 + k]} * p.guide.row(gy)[gx];
      }
      if (residual != nullptr) sum += int64_t{p.weights[kOtherResidual]} * (*residual)[i] * (1 << p.bits);
      const auto guess = static_cast<int>(std::clamp<int64_t>(sum >> (13 + p.bits), 0, p.most));
      out[i] = byte ? (guess + off) & 255 : std::clamp(guess + off, 0, p.most);
    }
  }
  return out;
}

void expect_values(const GuidedPlane& plane, const TileShape& shape, const std::vector<int>& values) {
  for (size_t y = 0; y < shape.height; ++y)
    for (size_t x = 0; x < shape.width; ++x)
      ASSERT_EQ(plane.values.row(static_cast<ptrdiff_t>(y))[x] >> plane.bits, values[y * shape.width + x])
          << x << ", " << y;
}

TEST(GuidedPlanes, DecodeToWhatThePageSays) {
  {
    GuidedPlane a, b, index;
    for (uint32_t seed = 0; seed < 96; ++seed) {
      SCOPED_TRACE(seed);
      std::mt19937 random(seed);
      const Mask mask = test::random_mask(kWidth, kHeight, seed % 3 == 1 ? 0.6 : 0.98, seed);
      TileShape shape;
      shape.reset(kWidth, kHeight, seed % 3 == 0 ? nullptr : &mask);
      // Some sums stay far from 2^31, some do not; planes are used again.
      const bool rough = (seed >> 3 & 1) != 0;
      const auto size = [&](uint32_t bit) { return (seed >> bit & 1) != 0 ? 119000 : 9000; };
      fill(a, shape, GuidedPlane::kByteBits, 254, size(0), rough, random);
      fill(b, shape, GuidedPlane::kByteBits, 254, size(1), rough, random);
      fill(index, shape, GuidedPlane::kIndexBits, 1023, size(2), rough, random);
      std::vector<int> residual, other, third;
      const std::vector<int> x = values_of(a, shape, nullptr, residual), y = values_of(b, shape, &residual, other),
                             i = values_of(index, shape, nullptr, third);
      for (size_t row = 0; row < shape.height; ++row) {
        a.decode_sums(shape, row, nullptr), b.decode_sums(shape, row, &a), index.decode_sums(shape, row, nullptr);
        decode_values(a, b, shape, row), decode_values(index, shape, row);
      }
      expect_values(a, shape, x), expect_values(b, shape, y), expect_values(index, shape, i);
    }
  }
}

TEST(Normals, RowsAreTurnedAsSingleCodes) {
  std::vector<uint16_t> codes(65536), back(65536);
  std::vector<int16_t> x(65536), y(65536);
  for (size_t i = 0; i < codes.size(); ++i) codes[i] = static_cast<uint16_t>(i);
  for (int pole = 0; pole <= kRaw; ++pole) {
    turn_normals(codes.data(), codes.size(), pole, x.data(), y.data());
    for (size_t i = 0; i < codes.size(); ++i)
      ASSERT_EQ(x[i] / 64 | y[i] / 64 << 8, turn_normal(codes[i], pole)) << i << ", pole " << pole;
    for (size_t i = 0; i < codes.size(); ++i)  // values that a stream may hold
      x[i] = static_cast<int16_t>((codes[i] & 255) * 64), y[i] = static_cast<int16_t>((codes[i] >> 8) * 64);
    turn_normals_back(x.data(), y.data(), codes.size(), pole, back.data());
    for (size_t i = 0; i < codes.size(); ++i) ASSERT_EQ(back[i], turn_back(codes[i], pole)) << i << ", " << pole;
  }
}

}  // namespace
}  // namespace telesplat::codec::detail
