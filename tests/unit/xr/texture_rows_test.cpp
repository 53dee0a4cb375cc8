// Rows of pictures in the layout of a headset's textures.
#include "client/displays/xr/picture_chain.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace telesplat::viewer {
namespace {

TEST(TextureRows, BytesAreRedGreenBlueAlpha) {
  for (const size_t pixels : {1u, 7u, 16u, 61u}) {
    std::vector<uint32_t> colour(pixels), out(pixels);
    for (size_t i = 0; i < pixels; ++i) colour[i] = 0x80112233u + uint32_t(i) * 0x01030507u;
    to_rgba(colour.data(), pixels, out.data());
    for (size_t i = 0; i < pixels; ++i) {
      const auto* bytes = reinterpret_cast<const uint8_t*>(&out[i]);
      EXPECT_EQ(bytes[0], colour[i] >> 16 & 0xff);
      EXPECT_EQ(bytes[1], colour[i] >> 8 & 0xff);
      EXPECT_EQ(bytes[2], colour[i] & 0xff);
      EXPECT_EQ(bytes[3], colour[i] >> 24);
    }
  }
}

TEST(TextureRows, TheNearestOfFourDepthsIsKept) {
  constexpr float kNothing = std::numeric_limits<float>::infinity();
  const DepthRange range{0.1, 50};
  for (const size_t pixels : {1u, 9u, 32u, 37u}) {
    std::vector<float> above(2 * pixels, kNothing), below(2 * pixels, kNothing), out(pixels);
    // In each block of four one pixel is near; in every fifth block all are infinitely far.
    for (size_t i = 0; i < pixels; ++i)
      if (i % 5 != 4) ((i & 1) ? above : below)[2 * i + (i >> 1 & 1)] = 0.1f + 0.3f * float(i);
    to_half_depth(above.data(), below.data(), range, pixels, out.data());
    std::vector<uint16_t> shares(pixels);
    to_half_depth(above.data(), below.data(), range, pixels, shares.data());
    for (size_t i = 0; i < pixels; ++i) {
      EXPECT_NEAR(shares[i] / 65535.0, out[i], 0.51 / 65535) << i;
      if (i % 5 == 4) {
        EXPECT_EQ(out[i], 1);
        continue;
      }
      // Undoes the projection of the depth.
      const double metres = 1 / (1 / range.near_m + out[i] * (1 / range.far_m - 1 / range.near_m));
      EXPECT_NEAR(metres, 0.1 + 0.3 * double(i), 2e-4 * metres * metres + 1e-6) << i;
    }
  }
}

}  // namespace
}  // namespace telesplat::viewer
