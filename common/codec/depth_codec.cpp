#include "common/codec/depth_codec.h"

#include <algorithm>
#include <array>
#include <string>

#include "common/codec/entropy.h"

namespace telesplat::codec {
namespace {

using detail::Reader;
using image::DepthImage;

constexpr uint8_t kMagic = 0xD7, kVersion = 1;

Error damaged(const char* what) { return Error{std::string("depth image stream: ") + what}; }

// Channels of one pixel as the predictor sees them: depth, green, red - green, blue - green, normal x, normal y.
constexpr int kChannels = 6;
constexpr int kStreams = 8;  // depth takes three byte planes
using Pixel = std::array<uint32_t, kChannels>;

uint32_t zigzag(uint32_t v, int bits) {
  const uint32_t mask = (1u << bits) - 1, sign = v >> (bits - 1) & 1;
  return ((v << 1) ^ (0 - sign)) & mask;
}
uint32_t unzigzag(uint32_t v, int bits) { return ((v >> 1) ^ (0 - (v & 1))) & ((1u << bits) - 1); }

Pixel split(uint32_t depth, uint32_t colour, uint16_t normal) {
  const uint32_t r = colour >> 16 & 255, g = colour >> 8 & 255, b = colour & 255;
  return {depth, g, (r - g) & 255, (b - g) & 255, normal & 255u, uint32_t{normal} >> 8};
}

// Walks the image with a filled copy of the last row, where holes hold their prediction; `code(i, prediction)` gives the
// pixel's channels for covered pixels.
template <class Covered, class Code>
void walk(int width, int height, Covered covered, Code code) {
  std::vector<Pixel> row(size_t(width) + 1, Pixel{});
  for (int y = 0; y < height; ++y) {
    Pixel left = row[1], up_left = row[1];
    for (int x = 0; x < width; ++x) {
      Pixel& up = row[x + 1];
      Pixel prediction;
      for (int c = 0; c < kChannels; ++c) prediction[c] = c == 0 ? (left[c] + up[c] - up_left[c]) & image::kMaxDepthCode : left[c];
      up_left = up;
      const size_t i = size_t(y) * width + x;
      if (covered(i)) left = code(i, prediction);
      up = left;
    }
  }
}

struct Header {
  int width = 0, height = 0;
  size_t pixels() const { return size_t(width) * height; }
};

Result<Header> read_header(Reader& in, size_t stream_bytes) {
  const auto magic = in.u8(), version = in.u8();
  if (!version) return damaged("shorter than its header");
  if (*magic != kMagic) return damaged("wrong magic byte");
  if (*version != kVersion) return Error{"depth image stream: version " + std::to_string(*version) + ", expected " + std::to_string(kVersion)};
  const auto width = in.varint(), height = in.varint();
  if (!height) return damaged("shorter than its header");
  if (*width == 0 || *height == 0 || *width > kMaxPixels || *height > kMaxPixels || *width * *height > kMaxPixels)
    return Error{"depth image stream: " + std::to_string(*width) + " x " + std::to_string(*height) + " pixels, limit " + std::to_string(kMaxPixels)};
  (void)stream_bytes;
  return Header{int(*width), int(*height)};
}

}  // namespace

std::vector<uint8_t> encode(const DepthImage& image) {
  const size_t pixels = image.pixels();
  CHECK(image.width > 0 && image.height > 0 && pixels <= kMaxPixels && image.colour.size() == pixels && image.normal.size() == pixels);
  std::vector<uint8_t> out{kMagic, kVersion};
  detail::put_varint(out, image.width);
  detail::put_varint(out, image.height);

  std::vector<uint8_t> mask((pixels + 7) / 8);
  for (size_t i = 0; i < pixels; ++i) mask[i / 8] |= uint8_t(image.depth[i] != 0) << i % 8;
  detail::put_block(out, mask);

  std::vector<uint8_t> streams[kStreams];
  walk(image.width, image.height, [&](size_t i) { return image.depth[i] != 0; },
       [&](size_t i, const Pixel& prediction) {
         const Pixel actual = split(image.depth[i], image.colour[i], image.normal[i]);
         const uint32_t d = zigzag(actual[0] - prediction[0], 24);
         for (int c = 0; c < 3; ++c) streams[c].push_back(uint8_t(d >> 8 * c));
         for (int c = 1; c < kChannels; ++c) streams[c + 2].push_back(uint8_t(zigzag(actual[c] - prediction[c], 8)));
         return actual;
       });
  for (const auto& stream : streams) detail::put_block(out, stream);
  return out;
}

Result<DepthImage> decode(std::span<const uint8_t> bytes, int expected_width, int expected_height) {
  Reader in(bytes);
  const auto header = read_header(in, bytes.size());
  if (!header) return header.error();
  if ((expected_width && header->width != expected_width) || (expected_height && header->height != expected_height))
    return Error{"depth image stream: " + std::to_string(header->width) + " x " + std::to_string(header->height) + " pixels, expected " +
                 std::to_string(expected_width) + " x " + std::to_string(expected_height)};
  const size_t pixels = header->pixels();
  std::vector<uint8_t> mask((pixels + 7) / 8);
  if (!detail::get_block(in, mask)) return damaged("damaged mask");
  if (pixels % 8) mask.back() &= uint8_t((1 << pixels % 8) - 1);
  size_t count = 0;
  for (const uint8_t byte : mask) count += __builtin_popcount(byte);

  std::vector<uint8_t> streams[kStreams];
  for (auto& stream : streams) {
    stream.resize(count);
    if (!detail::get_block(in, stream)) return damaged("damaged plane");
  }
  if (in.left() != 0) return damaged("bytes after its end");

  DepthImage image(header->width, header->height);
  size_t k = 0;
  bool zero_depth = false;
  walk(image.width, image.height, [&](size_t i) { return mask[i / 8] >> i % 8 & 1; },
       [&](size_t i, const Pixel& prediction) {
         Pixel p;
         p[0] = (prediction[0] + unzigzag(streams[0][k] | streams[1][k] << 8 | streams[2][k] << 16, 24)) & image::kMaxDepthCode;
         for (int c = 1; c < kChannels; ++c) p[c] = (prediction[c] + unzigzag(streams[c + 2][k], 8)) & 255;
         ++k;
         zero_depth |= p[0] == 0;
         image.depth[i] = p[0];
         image.colour[i] = ((p[2] + p[1]) & 255) << 16 | p[1] << 8 | ((p[3] + p[1]) & 255);
         image.normal[i] = uint16_t(p[4] | p[5] << 8);
         return p;
       });
  if (zero_depth) return damaged("covered pixel of depth 0");
  return image;
}

Result<StreamInfo> inspect(std::span<const uint8_t> bytes) {
  Reader in(bytes);
  const auto header = read_header(in, bytes.size());
  if (!header) return header.error();
  return StreamInfo{header->width, header->height};
}

}  // namespace telesplat::codec
