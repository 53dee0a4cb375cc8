// Decodes any bytes as a JPEG picture: gives an error, or a picture of the expected size. The first two bytes are that
// size.
#include "common/image/jpeg.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 2) return 0;
  const int width = 1 + data[0], height = 1 + data[1];
  std::vector<uint32_t> to(size_t(width) * size_t(height));
  (void)telesplat::image::decode_jpeg(std::as_bytes(std::span(data + 2, size - 2)), width, height, to.data(), width);
  return 0;
}
