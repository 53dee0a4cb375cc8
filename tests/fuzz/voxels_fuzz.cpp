// Decodes any bytes as voxels: gives an error, or voxels that survive another round trip. The first bytes choose the
// grid.
#include <cstdlib>

#include "common/volume/voxels.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat;
  if (size < 4) return 0;
  const int size_x = 1 + data[0], size_y = 1 + data[1] % 64, slices = 1 + data[2] % 16;
  const int levels = data[3] % 2 ? 256 : 4096;
  const auto voxels = volume::decode_voxels({data + 4, size - 4}, size_x, size_y, 0, slices, levels);
  if (!voxels.ok()) return 0;
  const auto bytes = volume::encode_voxels(*voxels, size_x, size_y);
  const auto again = volume::decode_voxels(bytes, size_x, size_y, voxels->k_begin, voxels->k_end, levels);
  if (!again.ok()) std::abort();
  // Normals without voxels must not remain.
  if (!(*again == *voxels)) std::abort();
  return 0;
}
