// Small and extreme images through the codec, sizes of streams, and bytes of the format.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>

#include "common/codec/depth_codec.h"
#include "common/codec/mask_stream.h"
#include "common/image/normal.h"
#include "tests/support/codec/codec_images.h"
#include "tests/support/depth_images.h"

namespace telesplat::codec {
namespace {

using image::DepthImage;

void expect_round_trip(const DepthImage& image) {
  const auto bytes = encode(image);
  const auto back = decode(bytes, image.width, image.height);
  ASSERT_TRUE(back.ok()) << back.error().text;
  EXPECT_TRUE(*back == image) << image.width << " x " << image.height;
  EXPECT_EQ(encode(image), bytes) << "not deterministic";
}

DepthImage filled(int width, int height, uint32_t depth, uint32_t colour, uint16_t normal) {
  DepthImage image(width, height);
  std::fill(image.depth.begin(), image.depth.end(), depth);
  std::fill(image.colour.begin(), image.colour.end(), colour);
  std::fill(image.normal.begin(), image.normal.end(), normal);
  return image;
}

TEST(CodecRoundTrip, EmptyImagesTakeAByteATile) {
  for (const auto& [width, height] : {std::pair{1, 1}, {256, 256}, {1280, 800}, {65536, 256}}) {
    const DepthImage image(width, height);
    expect_round_trip(image);
    EXPECT_LE(encode(image).size(), 8 + (image.pixels() + 40959) / 40960);
  }
  EXPECT_LE(encode(DepthImage(256, 256)).size(), 8u);
}

TEST(CodecRoundTrip, SinglePixels) {
  for (const uint32_t depth : {1u, 2u, 0x800000u, image::kMaxDepthCode})
    expect_round_trip(filled(1, 1, depth, 0xFFFFFF, 0xFFFF));
  for (const size_t at : {size_t{0}, size_t{77}, size_t{300 * 200 - 1}}) {
    DepthImage image(300, 200);
    image.depth[at] = 12345, image.colour[at] = 0x010203, image.normal[at] = 0x0405;
    expect_round_trip(image);
    EXPECT_LT(encode(image).size(), 64u);
  }
}

// Too few pixels for a fit to use any.
TEST(CodecRoundTrip, FewPixels) {
  for (int height = 1; height <= 4; ++height)
    for (int width = 1; width <= 5; ++width) {
      DepthImage image(width, height);
      for (uint32_t i = 0; i < image.pixels(); ++i) {
        image.depth[i] = 0x10000 + 977 * i * i;
        image.colour[i] = 0x0f1e2d * (i % 3 + 1);
        image.normal[i] = static_cast<uint16_t>(0x4040 + 0x0311 * i);
      }
      expect_round_trip(image);
    }
}

TEST(CodecRoundTrip, LinesOfPixels) {
  for (const int n : {2, 3, 7, 8, 9, 63, 64, 65, 255, 256, 257, 1000, 70000}) {
    expect_round_trip(test::random_pixels(n, 1, 1, static_cast<uint32_t>(n)));
    expect_round_trip(test::random_pixels(1, n, 1, static_cast<uint32_t>(n)));
    expect_round_trip(test::random_pixels(n, 1, 0.3, static_cast<uint32_t>(n)));
    expect_round_trip(test::random_pixels(1, n, 0.3, static_cast<uint32_t>(n)));
  }
}

TEST(CodecRoundTrip, ConstantImagesCostNearlyNothing) {
  for (const uint32_t depth : {1u, 0x123456u, image::kMaxDepthCode}) {
    const DepthImage image = filled(256, 256, depth, 0xA0B0C0, 0x1234);
    expect_round_trip(image);
    EXPECT_LT(encode(image).size(), 64u);
  }
}

TEST(CodecRoundTrip, ConstantAlbedoCostsNearlyNothing) {
  DepthImage image = test::random_pixels(256, 256, 1, 5);
  std::fill(image.colour.begin(), image.colour.end(), 0x808080);
  expect_round_trip(image);
  EXPECT_LT(inspect(encode(image)).value().colour_bytes, 16u);
}

TEST(CodecRoundTrip, Checkerboards) {
  for (const int step : {1, 2, 5}) {
    DepthImage image = test::random_pixels(130, 67, 1, 3);
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        if ((x / step + y / step) % 2 != 0) {
          const size_t i = static_cast<size_t>(y * image.width + x);
          image.depth[i] = image.colour[i] = image.normal[i] = 0;
        }
    expect_round_trip(image);
    EXPECT_LT(inspect(encode(image)).value().mask_bytes, 130u * 67 / 8) << "the mask's pattern is not used";
  }
}

TEST(CodecRoundTrip, NoiseGrowsLittle) {
  const DepthImage image = test::random_pixels(256, 256, 1, 9);
  expect_round_trip(image);
  EXPECT_LT(encode(image).size(), image.pixels() * image::kRawBytesPerPixel * 102 / 100);
}

TEST(CodecRoundTrip, ExtremeSteps) {
  // Largest differences in both directions, in every channel.
  DepthImage image = filled(64, 64, 1, 0, 0);
  for (size_t i = 0; i < image.pixels(); i += 3)
    image.depth[i] = image::kMaxDepthCode, image.colour[i] = 0xFFFFFF, image.normal[i] = 0xFFFF;
  expect_round_trip(image);
  expect_round_trip(filled(64, 64, image::kMaxDepthCode, 0xFFFFFF, 0xFFFF));
}

TEST(CodecRoundTrip, PlanesLeaveOnlyRounding) {
  const DepthImage image = test::plane(256, 256, 301.7, -129.3);
  expect_round_trip(image);
  EXPECT_LT(inspect(encode(image)).value().depth_bytes, image.pixels() * 5 / 16) << "2.5 bits a pixel";
}

// The depth of a scattered pixel of a plane is predicted from its neighbours all around, at any distance.
TEST(CodecRoundTrip, ScatteredPixelsOfAPlaneLeaveOnlyRounding) {
  for (const double density : {0.003, 0.03, 0.1}) {
    DepthImage image = test::plane(256, 256, 301.7, -129.3);
    std::fill(image.colour.begin(), image.colour.end(), 0x808080);
    test::keep_random(image, density, 3);
    expect_round_trip(image);
    const StreamInfo info = inspect(encode(image)).value();
    EXPECT_LT(info.sparse_bytes, 40 + info.covered_pixels * 9 / 8) << "9 bits a pixel of depth and normal, " << density;
  }
}

TEST(CodecRoundTrip, DecodesIntoUsedMemory) {
  DepthImage image = test::random_pixels(300, 200, 1, 1);
  for (const double density : {0.0, 0.02, 0.5, 1.0}) {
    const DepthImage next = test::random_pixels(200, 280, density, 4);
    const Status status = decode_into(image, encode(next));
    ASSERT_TRUE(status.ok()) << status.error().text;
    EXPECT_TRUE(image == next) << density;
  }
  EXPECT_FALSE(decode_into(image, {}).ok());
  EXPECT_TRUE(image == DepthImage());
}

TEST(CodecRoundTrip, InspectAddsUp) {
  const DepthImage image = test::random_pixels(700, 300, 0.4, 8);
  const auto bytes = encode(image);
  const StreamInfo info = inspect(bytes).value();
  EXPECT_EQ(info.width, 700);
  EXPECT_EQ(info.height, 300);
  EXPECT_EQ(info.covered_pixels, static_cast<size_t>(std::count_if(image.depth.begin(), image.depth.end(),
                                                                   [](uint32_t d) { return d != 0; })));
  const size_t parts = info.mask_bytes + info.depth_bytes + info.colour_bytes + info.normal_bytes + info.sparse_bytes;
  EXPECT_LE(parts, bytes.size());
  EXPECT_GE(parts + 9 * 6 + 8, bytes.size()) << "six tiles of a kind and a base, and a header";
}

// A change of the format changes its version, docs/codec.md, docs/protocol.md and these bytes.
TEST(CodecFormat, GoldenBytes) {
  DepthImage image(4, 3);
  const uint32_t depth[] = {1000, 1010, 1020, 0, 1100, 1110, 1125, 0, 1200, 1210, 1220, 1231};
  for (size_t i = 0; i < image.pixels(); ++i)
    if (depth[i] != 0) {
      image.depth[i] = depth[i];
      image.colour[i] = 0x102030 + static_cast<uint32_t>(i % 4) * 0x010203;
      image.normal[i] = static_cast<uint16_t>(0x8040 + i);
    }
  const std::vector<uint8_t> golden{
      215, 12,  0,   4,   3,   5,   232, 3,   0,   48,  32,  16,  64,  128, 4,   185, 179, 5,   64,  241, 15,  131, 127,
      225, 139, 0,   0,   79,  1,   55,  1,   0,   0,   0,   0,   0,   0,   0,   0,   0,   0,   0,   0,   0,   0,   128,
      191, 255, 181, 175, 0,   252, 156, 23,  94,  0,   0,   0,   0,   0,   0,   0,   0,   0,   127, 208, 182, 109, 219,
      182, 109, 219, 182, 109, 219, 182, 109, 219, 182, 109, 219, 182, 13,  35,  52,  0,   16,  62,  250, 131, 22,  207,
      184, 2,   0,   0,   96,  186, 86,  155, 220, 247, 125, 223, 187, 174, 235, 186, 174, 235, 186, 78,  0,   8,   57,
      170, 86,  85,  21,  27,  6,   248, 248, 227, 31,  135, 136, 65,  196, 32,  98,  1,   64,  112, 252, 145, 87,  204,
      3,   221, 221, 221, 221, 221, 221, 221, 13,  1,   0,   0,   66,  42,  86,  200, 110, 1,   241, 190, 1,   0,   181,
      236, 76,  0,   88,  63,  255, 0,   173, 0,   4,   0,   29,  182, 18,  0,   224, 137, 90,  0,   167, 97,  32,  0};
  EXPECT_EQ(encode(image), golden);
  const auto back = decode(golden);
  ASSERT_TRUE(back.ok()) << back.error().text;
  EXPECT_TRUE(*back == image);
}

std::vector<std::vector<uint8_t>> seeds_of(const std::string& fuzzer) {
  std::vector<std::vector<uint8_t>> out;
  for (const auto& entry : std::filesystem::directory_iterator("tests/fuzz/corpus/" + fuzzer)) {
    std::ifstream file(entry.path(), std::ios::binary);
    out.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return out;
}

// Seeds of an older version would all be refused at their second byte.
TEST(CodecFormat, SeedsOfTheFuzzersAreOfThisVersion) {
  const auto images = seeds_of("codec"), refinements = seeds_of("refinement"), masks = seeds_of("mask");
  EXPECT_GE(images.size(), 32u);
  EXPECT_GE(refinements.size(), 8u);
  EXPECT_GE(masks.size(), 9u);
  for (const auto& bytes : images) EXPECT_TRUE(decode(bytes).ok());
  const auto known = test::refined_images();
  for (const auto& bytes : refinements) {  // the first byte chooses the image
    const auto& of = known[bytes[0] % known.size()];
    const auto exact = decode_refinement(std::span(bytes).subspan(1), of.bounded);
    ASSERT_TRUE(exact.ok()) << exact.error().text;
    EXPECT_EQ(*exact, of.exact);
  }
  for (const auto& bytes : masks) {  // the first two bytes are the size
    std::vector<uint32_t> words((bytes.size() - 2) / 4);
    if (!words.empty()) std::memcpy(words.data(), bytes.data() + 2, 4 * words.size());
    EXPECT_TRUE(decode_mask(words, bytes[0] + 1, bytes[1] + 1).ok());
  }
}

// Sparse tiles are predicted in floating point, which must be the same on all machines: so must these bytes.
TEST(CodecFormat, GoldenBytesOfASparseTile) {
  DepthImage image(9, 8);
  for (const auto& [x, y] : {std::pair{0, 0}, {4, 0}, {8, 1}, {1, 3}, {5, 3}, {7, 4}, {2, 6}, {3, 7}, {8, 7}}) {
    const size_t i = static_cast<size_t>(y * 9 + x);
    image.depth[i] = static_cast<uint32_t>(500000 + 1234 * x - 777 * y + x * x * y);
    image.colour[i] = 0x405060 + static_cast<uint32_t>(x) * 0x030201;
    image.normal[i] = static_cast<uint16_t>((250 + 2 * x) % 256 | (100 - y) << 8);
  }
  const std::vector<uint8_t> golden{215, 12, 0,  9,   8,   6,   32, 161, 7,   96,  80,  64,  250, 100, 16,  163, 15,
                                    186, 98, 90, 36,  93,  192, 6,  101, 127, 253, 46,  169, 5,   139, 210, 61,  156,
                                    27,  98, 14, 130, 242, 53,  82, 27,  42,  11,  147, 224, 44,  201, 195, 192};
  EXPECT_EQ(encode(image), golden);
  const auto back = decode(golden);
  ASSERT_TRUE(back.ok()) << back.error().text;
  EXPECT_TRUE(*back == image);
}

// Canonical normals, as most of a session's images have them: the tile's pole turns them.
TEST(CodecFormat, GoldenBytesOfASparseTileThatIsTurned) {
  DepthImage image(9, 8);
  for (const auto& [x, y] : {std::pair{0, 0}, {4, 0}, {8, 1}, {1, 3}, {5, 3}, {7, 4}, {2, 6}, {3, 7}, {8, 7}}) {
    const size_t i = static_cast<size_t>(y * 9 + x);
    image.depth[i] = static_cast<uint32_t>(500000 + 1234 * x - 777 * y + x * x * y);
    image.colour[i] = 0x405060 + static_cast<uint32_t>(x % 3) * 0x030201;
    image.normal[i] = image::canonical_normal16(static_cast<uint16_t>((244 + x) | (100 - y) << 8));
  }
  const std::vector<uint8_t> golden{215, 12,  0,   9,  8,  6,   32,  161, 7,   96,  80, 64,  244, 100, 16,  163, 15,
                                    186, 98,  90,  36, 93, 192, 0,   105, 127, 253, 46, 169, 5,   128, 182, 6,   64,
                                    194, 133, 137, 32, 32, 214, 124, 46,  183, 218, 47, 244, 155, 228, 21,  46,  64};
  EXPECT_EQ(encode(image), golden);
  const auto back = decode(golden);
  ASSERT_TRUE(back.ok()) << back.error().text;
  EXPECT_TRUE(*back == image);
  auto other = golden;
  ASSERT_EQ(other[23], 0) << "the pole, after the mask";
  other[23] = 7;
  EXPECT_FALSE(decode(other).ok()) << "there is no pole 7";
}

}  // namespace
}  // namespace telesplat::codec
