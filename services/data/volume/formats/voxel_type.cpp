#include "services/data/volume/volume.h"

namespace telesplat::data {

size_t voxel_bytes(VoxelType type) {
  switch (type) {
    case VoxelType::kU8:
    case VoxelType::kI8:
      return 1;
    case VoxelType::kU16:
    case VoxelType::kI16:
      return 2;
    case VoxelType::kF32:
      return 4;
  }
  return 0;
}

const char* name_of(VoxelType type) {
  switch (type) {
    case VoxelType::kU8:
      return "u8";
    case VoxelType::kI8:
      return "i8";
    case VoxelType::kU16:
      return "u16";
    case VoxelType::kI16:
      return "i16";
    case VoxelType::kF32:
      return "f32";
  }
  return "?";
}

}  // namespace telesplat::data
