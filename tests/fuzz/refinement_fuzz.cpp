// Decodes any bytes as the refinement of an image: gives an error, or a canonical image that covers the same pixels and
// survives another round trip. The first byte chooses the image.
#include <cstdlib>

#include "common/codec/depth_codec.h"
#include "tests/support/codec/codec_images.h"
#include "tests/support/depth_images.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat;
  static const auto all = test::refined_images();
  if (size == 0) return 0;
  const image::DepthImage& bounded = all[data[0] % all.size()].bounded;
  const auto image = codec::decode_refinement({data + 1, size - 1}, bounded);
  if (!image.ok()) return 0;
  if (!test::is_canonical(*image)) std::abort();
  for (size_t i = 0; i < bounded.pixels(); ++i)
    if ((image->depth[i] == 0) != (bounded.depth[i] == 0)) std::abort();
  const auto again = codec::decode_refinement(codec::encode_refinement(*image, bounded), bounded);
  if (!again.ok() || !(*again == *image)) std::abort();
  return 0;
}
