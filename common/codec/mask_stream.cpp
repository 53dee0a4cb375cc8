#include "common/codec/mask_stream.h"

#include <fmt/format.h>

#include <cstring>

#include "common/codec/depth_codec.h"
#include "common/codec/mask.h"
#include "common/core/check.h"

namespace telesplat::codec {
namespace {

void check_size(int width, int height) {
  CHECK(width > 0 && height > 0 && static_cast<size_t>(width) * static_cast<size_t>(height) <= kMaxPixels);
}

}  // namespace

std::vector<uint32_t> encode_mask(const image::PixelMask& mask) {
  check_size(mask.width(), mask.height());
  std::vector<uint8_t> bytes;
  detail::put_mask(bytes, mask);
  std::vector<uint32_t> words((bytes.size() + 3) / 4);
  std::memcpy(words.data(), bytes.data(), bytes.size());
  return words;
}

Result<image::PixelMask> decode_mask(std::span<const uint32_t> words, int width, int height) {
  check_size(width, height);
  detail::Reader in({reinterpret_cast<const uint8_t*>(words.data()), words.size_bytes()});
  image::PixelMask mask(width, height);
  // Up to three bytes fill the last word.
  if (!detail::get_mask(in, mask) || in.left() > 3)
    return Error{
        fmt::format("the mask of a tile of {} x {} pixels: {} words are no mask", width, height, words.size())};
  return mask;
}

}  // namespace telesplat::codec
