// Decodes any bytes as slice images: gives an error, or images that survive another round trip. The first two bytes are
// the raster's size.
#include <cstdlib>

#include "common/volume/slices/image.h"
#include "tests/support/volume/slices.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat::volume;
  if (size < 2) return 0;
  const int width = 1 + 3 * data[0], height = 1 + 2 * data[1], layers = 1 + data[0] % 64;
  const auto slices = parse_slices({data + 2, size - 2}, width, height, layers);
  if (!slices.ok()) return 0;
  for (const auto& slice : *slices) {
    const auto image = decode_slice(slice, width, height);
    if (!image.ok()) continue;
    const auto bytes = encode_slice(*image);
    if (bytes.empty()) continue;  // all blocks may be empty
    const auto again = parse_slices(bytes, width, height, layers);
    if (!again.ok() || again->size() != 1) std::abort();
    const auto back = decode_slice(again->front(), width, height);
    if (!back.ok()) std::abort();
    // The remaining pixels are equal; transparent ones may have been cropped.
    const auto at = [](const SliceImage& i, int x, int y) {
      const auto& r = i.rect;
      if (x < r.x || y < r.y || x >= r.x + r.width || y >= r.y + r.height) return uint32_t{0};
      return i.pixels[size_t(y - r.y) * size_t(r.width) + size_t(x - r.x)];
    };
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        if (at(*image, x, y) != at(*back, x, y)) std::abort();
  }
  return 0;
}
