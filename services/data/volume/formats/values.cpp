// From stored voxels to a Volume: byte order, types, range.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "services/data/volume/formats/payload.h"

namespace telesplat::data {
namespace {

struct Range {
  double lo = std::numeric_limits<double>::infinity(), hi = -std::numeric_limits<double>::infinity();
  uint64_t not_finite = 0;
};

template <class T>
Range range_of(const std::byte* bytes, size_t count) {
  const T* v = reinterpret_cast<const T*>(bytes);  // a vector's storage is aligned for anything
  T lo = std::numeric_limits<T>::max(), hi = std::numeric_limits<T>::lowest();
  uint64_t not_finite = 0;
  if constexpr (std::is_integral_v<T>) {
    for (size_t i = 0; i < count; ++i) lo = std::min(lo, v[i]), hi = std::max(hi, v[i]);
  } else {
    for (size_t i = 0; i < count; ++i) {
      const bool finite = v[i] - v[i] == 0;  // neither NaN nor infinite
      not_finite += !finite;
      lo = finite && v[i] < lo ? v[i] : lo;
      hi = finite && v[i] > hi ? v[i] : hi;
    }
  }
  return not_finite == count ? Range{0, 0, not_finite} : Range{double(lo), double(hi), not_finite};
}

Range range_of(VoxelType type, const std::byte* bytes, size_t count) {
  switch (type) {
    case VoxelType::kU8:
      return range_of<uint8_t>(bytes, count);
    case VoxelType::kI8:
      return range_of<int8_t>(bytes, count);
    case VoxelType::kU16:
      return range_of<uint16_t>(bytes, count);
    case VoxelType::kI16:
      return range_of<int16_t>(bytes, count);
    default:
      return range_of<float>(bytes, count);
  }
}

template <class T>
void swap_bytes(std::vector<std::byte>& bytes) {
  for (size_t at = 0; at + sizeof(T) <= bytes.size(); at += sizeof(T))
    std::reverse(bytes.begin() + ptrdiff_t(at), bytes.begin() + ptrdiff_t(at + sizeof(T)));
}

// In place: what is written never overtakes what is read. Values whose range has less than 4096 of the steps that f32
// has there, or that f32 does not reach, become fractions of half that range around its middle: scale and offset.
template <class T>
Status narrow(std::vector<std::byte>& bytes, StoredType type, const std::string& path, double& scale, double& offset) {
  const size_t count = bytes.size() / sizeof(T);
  const Range range = range_of<T>(bytes.data(), count);
  const double largest = std::max(std::abs(range.lo), std::abs(range.hi));
  const double steps = (range.hi - range.lo) / (largest * 0x1p-24);
  const bool fraction = largest > double(std::numeric_limits<float>::max()) || (range.hi > range.lo && steps < 4096);
  const double half = (range.hi - range.lo) / 2, middle = range.lo + half;
  if (!std::isfinite(half))
    return Error{fmt::format("{}: its values of type {} go from {} to {}, more than a number can tell", path,
                             name_of(type), range.lo, range.hi)};
  for (size_t i = 0; i < count; ++i) {
    T wide;
    std::memcpy(&wide, bytes.data() + i * sizeof(T), sizeof wide);
    const auto value = fraction && half > 0 ? static_cast<float>((double(wide) - middle) / half)
                       : fraction           ? 0.0f
                                            : static_cast<float>(wide);
    std::memcpy(bytes.data() + i * sizeof value, &value, sizeof value);
  }
  if (fraction) offset += middle * scale, scale *= half > 0 ? half : 1;
  bytes.resize(count * sizeof(float));
  if (sizeof(T) > sizeof(float)) bytes.shrink_to_fit();
  return ok_status();
}

}  // namespace

Result<Volume> make_volume(const VolumeFileHeader& h, std::vector<std::byte> bytes, const std::string& path) {
  if (bytes.size() != h.voxel_bytes())
    return Error{fmt::format("{}: {} bytes of voxels, its header says {}", path, bytes.size(), h.voxel_bytes())};
  if (h.big_endian == (std::endian::native == std::endian::little) && h.encoding != Encoding::kText) {
    if (stored_bytes(h.stored) == 2) swap_bytes<uint16_t>(bytes);
    if (stored_bytes(h.stored) == 4) swap_bytes<uint32_t>(bytes);
    if (stored_bytes(h.stored) == 8) swap_bytes<uint64_t>(bytes);
  }
  Volume v;
  v.scale = h.scale, v.offset = h.offset;
  auto status = ok_status();
  switch (h.stored) {
    case StoredType::kU8:
      v.type = VoxelType::kU8;
      break;
    case StoredType::kI8:
      v.type = VoxelType::kI8;
      break;
    case StoredType::kU16:
      v.type = VoxelType::kU16;
      break;
    case StoredType::kI16:
      v.type = VoxelType::kI16;
      break;
    default:
      v.type = VoxelType::kF32;
  }
  if (h.stored == StoredType::kU32) status = narrow<uint32_t>(bytes, h.stored, path, v.scale, v.offset);
  if (h.stored == StoredType::kI32) status = narrow<int32_t>(bytes, h.stored, path, v.scale, v.offset);
  if (h.stored == StoredType::kU64) status = narrow<uint64_t>(bytes, h.stored, path, v.scale, v.offset);
  if (h.stored == StoredType::kI64) status = narrow<int64_t>(bytes, h.stored, path, v.scale, v.offset);
  if (h.stored == StoredType::kF64) status = narrow<double>(bytes, h.stored, path, v.scale, v.offset);
  if (!status) return status.error();
  v.size = {int(h.size[0]), int(h.size[1]), int(h.size[2])};
  v.index_to_data = h.index_to_data;
  v.unit = h.unit;
  v.space = h.space;
  v.stored = std::move(bytes);
  v.format = h.format;
  v.array = h.array;
  const Range range = range_of(v.type, v.stored.data(), h.voxels());
  if (range.not_finite == h.voxels())
    return Error{fmt::format("{}: none of its {} values is finite", path, h.voxels())};
  v.not_finite = range.not_finite;
  v.lo = std::min(range.lo * v.scale, range.hi * v.scale) + v.offset;
  v.hi = std::max(range.lo * v.scale, range.hi * v.scale) + v.offset;
  // Air is -1000 and bone above 300; no other scale has integers on both sides that far.
  v.hounsfield = h.ct || (v.type != VoxelType::kF32 && v.lo <= -500 && v.lo >= -32768 && v.hi >= 300);
  return v;
}

}  // namespace telesplat::data
