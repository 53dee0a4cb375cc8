#include "services/data/base/volume.h"

#include <cmath>
#include <cstring>

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

double Volume::value(size_t at) const {
  const auto get = [&]<class T>(T) {
    T v;
    std::memcpy(&v, stored.data() + at * sizeof(T), sizeof(T));
    return static_cast<double>(v);
  };
  switch (type) {
    case VoxelType::kU8:
      return get(uint8_t{}) * scale + offset;
    case VoxelType::kI8:
      return get(int8_t{}) * scale + offset;
    case VoxelType::kU16:
      return get(uint16_t{}) * scale + offset;
    case VoxelType::kI16:
      return get(int16_t{}) * scale + offset;
    case VoxelType::kF32:
      break;
  }
  const double v = get(float{}) * scale + offset;
  return std::isfinite(v) ? v : lo;
}

geometry::DBox Volume::box() const {
  geometry::DBox out;
  for (int corner = 0; corner < 8; ++corner) {
    const auto at = [&](int axis) { return corner >> axis & 1 ? size[size_t(axis)] - 0.5 : -0.5; };
    out.extend(glm::dvec3(index_to_data * glm::dvec4(at(0), at(1), at(2), 1)));
  }
  return out;
}

}  // namespace telesplat::data
