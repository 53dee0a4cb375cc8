// Streams with false claims: each is refused with a reason, and none allocates the memory that it claims.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include "common/codec/depth_codec.h"
#include "tests/support/depth_images.h"

namespace telesplat::codec {
namespace {

std::string refusal(const std::vector<uint8_t>& bytes, int width = 0, int height = 0) {
  const auto image = decode(bytes, width, height);
  return image.ok() ? "" : image.error().text;
}

TEST(CodecBadInput, Headers) {
  EXPECT_NE(refusal({}).find("shorter than its header"), std::string::npos);
  EXPECT_NE(refusal({0xD7}).find("shorter than its header"), std::string::npos);
  EXPECT_NE(refusal({0xD7, 12, 0, 5}).find("shorter than its header"), std::string::npos);
  EXPECT_NE(refusal({'P', 'N', 'G', 0, 0}).find("begins with 0x50"), std::string::npos);
  EXPECT_NE(refusal({0xD7, 99, 0, 1, 1, 0}).find("version 99, expected 12"), std::string::npos);
  EXPECT_NE(refusal({0xD7, 12, 0, 0, 1, 0}).find("0 x 1 pixels"), std::string::npos);
  EXPECT_NE(refusal({0xD7, 12, 0, 1, 0, 0}).find("1 x 0 pixels"), std::string::npos);
  EXPECT_NE(refusal({0xD7, 12, 4, 1, 1, 0}).find("flags 0x04, known 0x03"), std::string::npos);
}

TEST(CodecBadInput, SizesBeyondTheLimit) {
  // 2^31 x 2^31, 4097 x 4096, and numbers without an end.
  EXPECT_NE(refusal({0xD7, 12, 0, 0x80, 0x80, 0x80, 0x80, 8, 0x80, 0x80, 0x80, 0x80, 8, 0}).find("limit 16777216"),
            std::string::npos);
  EXPECT_NE(refusal({0xD7, 12, 0, 0x81, 0x20, 0x80, 0x20, 0}).find("4097 x 4096"), std::string::npos);
  EXPECT_NE(refusal({0xD7, 12, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 1, 1}), "");
  EXPECT_NE(refusal({0xD7, 12, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0x7F, 1, 0}), "");
}

TEST(CodecBadInput, SizesThatTheStreamCannotHold) {
  // 4096 x 4096 pixels are 256 tiles, which take 256 bytes at least.
  std::vector<uint8_t> bytes{0xD7, 12, 0, 0x80, 0x20, 0x80, 0x20};
  bytes.resize(7 + 255);
  EXPECT_NE(refusal(bytes).find("255 bytes left for 4096 x 4096 pixels, which take 256 or more"), std::string::npos);
  bytes.push_back(0);
  EXPECT_EQ(refusal(bytes), "");
  bytes.push_back(0);
  EXPECT_NE(refusal(bytes).find("1 bytes after its end"), std::string::npos);
}

TEST(CodecBadInput, UnexpectedSizes) {
  const auto bytes = encode(image::DepthImage(30, 20));
  EXPECT_EQ(refusal(bytes, 30, 20), "");
  EXPECT_NE(refusal(bytes, 31, 20).find("30 x 20 pixels, expected 31 x 20"), std::string::npos);
  EXPECT_NE(refusal(bytes, 0, 21), "");
}

TEST(CodecBadInput, CoveredPixelsOfDepthZero) {
  // A full tile of one pixel whose base is 0 and whose residual is 0. With base 1 the same bytes are valid.
  std::vector<uint8_t> bytes = encode([] {
    image::DepthImage image(1, 1);
    image.depth[0] = 1;
    return image;
  }());
  ASSERT_EQ(refusal(bytes), "");
  ASSERT_EQ(bytes[6], 1) << "the base depth's low byte follows magic, version, flags, width, height, kind";
  bytes[6] = 0;
  EXPECT_NE(refusal(bytes).find("tile 0, 0"), std::string::npos);
}

TEST(CodecBadInput, EveryTileKind) {
  auto bytes = encode(test::random_pixels(20, 20, 1, 1));
  for (int kind = 0; kind < 256; ++kind) {
    bytes[5] = static_cast<uint8_t>(kind);
    if (kind == 1) continue;  // dense, the stream's own
    EXPECT_NE(refusal(bytes), "") << kind;
  }
}

TEST(CodecBadInput, InspectRefusesToo) {
  const auto bytes = encode(test::random_pixels(40, 30, 0.5, 2));
  for (size_t length = 0; length < bytes.size(); ++length)
    EXPECT_FALSE(inspect(std::span(bytes).first(length)).ok()) << length;
  EXPECT_TRUE(inspect(bytes).ok());
}

// Kernels read 64 bytes beyond a tile's words: also if nothing follows them.
TEST(CodecBadInput, LongHeadersBeforeNoWordsAreReadWithinTheStream) {
  for (const int width : {64, 5}) {
    image::DepthImage image(width, 1);
    for (size_t i = 0; i < image.pixels(); ++i) image.depth[i] = 1000, image.colour[i] = 0x80, image.normal[i] = 0x7F7F;
    std::vector<uint8_t> bytes = encode(image);
    ASSERT_TRUE(decode(bytes));
    constexpr size_t kHeaders = 5 + 1 + 8 + 1;  // stream's header, tile's kind, its base, its way of colours
    const size_t normals = kHeaders + 1 + bytes[kHeaders];
    ASSERT_LT(normals + bytes[normals], bytes.size());
    const std::vector<uint8_t> words(bytes.end() - 4, bytes.end());
    ASSERT_EQ(words, (std::vector<uint8_t>{0, 0, 0, 0})) << "no words, no states";
    // Replaces the header of normals by 300 bytes of any content; the rest follows.
    std::vector<uint8_t> longer(bytes.begin(), bytes.begin() + static_cast<ptrdiff_t>(normals));
    longer.push_back(0x80 | (300 & 127)), longer.push_back(300 >> 7);
    longer.insert(longer.end(), 300, 0xFF);
    longer.insert(longer.end(), bytes.begin() + static_cast<ptrdiff_t>(normals + 1 + bytes[normals]), bytes.end());
    const long page = sysconf(_SC_PAGESIZE);
    auto* const pages = static_cast<uint8_t*>(
        mmap(nullptr, static_cast<size_t>(2 * page), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
    ASSERT_NE(pages, MAP_FAILED);
    ASSERT_EQ(mprotect(pages + page, static_cast<size_t>(page), PROT_NONE), 0);
    uint8_t* const at = pages + page - longer.size();
    std::copy(longer.begin(), longer.end(), at);
    EXPECT_FALSE(decode(std::span(at, longer.size())));
    munmap(pages, static_cast<size_t>(2 * page));
  }
}

}  // namespace
}  // namespace telesplat::codec
