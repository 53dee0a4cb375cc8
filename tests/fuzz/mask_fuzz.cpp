// Decodes any words as a tile's mask: gives an error, or a mask that comes back the same. Two bytes are its size.
#include <cstdlib>
#include <cstring>
#include <vector>

#include "common/codec/mask_stream.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat;
  if (size < 2) return 0;
  const int width = data[0] + 1, height = data[1] + 1;
  std::vector<uint32_t> words((size - 2) / 4);
  if (!words.empty()) std::memcpy(words.data(), data + 2, words.size() * 4);
  const auto mask = codec::decode_mask(words, width, height);
  if (!mask) return 0;
  if (mask->width() != width || mask->height() != height) std::abort();
  const auto again = codec::decode_mask(codec::encode_mask(*mask), width, height);
  if (!again || !(*again == *mask)) std::abort();
  return 0;
}
