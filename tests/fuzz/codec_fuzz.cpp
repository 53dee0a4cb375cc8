// Decodes any bytes as a depth image: gives an error, or a canonical image that survives another round trip, and a
// bounded one whose refinement makes it exact.
#include <cstdlib>
#include <span>

#include "common/codec/depth_codec.h"
#include "tests/support/depth_images.h"

namespace {

using namespace telesplat;

void decode_and_check(std::span<const uint8_t> bytes, const Result<codec::StreamInfo>& info) {
  const auto image = codec::decode(bytes);
  if (!image.ok()) return;
  if (!info.ok() || info->width != image->width || info->height != image->height) std::abort();
  size_t covered = 0;
  for (const uint32_t depth : image->depth) covered += depth != 0;
  if (covered != info->covered_pixels || !test::is_canonical(*image)) std::abort();
  const auto again = codec::decode(codec::encode(*image), image->width, image->height);
  if (!again.ok() || !(*again == *image)) std::abort();
  if (info->bounds.exact()) return;
  const auto bounded = codec::decode(codec::encode(*image, info->bounds), image->width, image->height);
  if (!bounded.ok() || !test::is_canonical(*bounded)) std::abort();
  const auto exact = codec::decode_refinement(codec::encode_refinement(*image, *bounded), *bounded);
  if (!exact.ok() || !(*exact == *image)) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::span<const uint8_t> bytes(data, size);
  const auto info = codec::inspect(bytes);
  // Large sizes are legal in small streams, but slow to fuzz.
  if (info.ok() && size_t(info->width) * size_t(info->height) > size_t{1} << 18) return 0;
  decode_and_check(bytes, info);
  return 0;
}
