// Types of numbers that files store.
#pragma once

#include <cstddef>
#include <cstdint>

namespace telesplat::data {

/// Volume has the narrower ones of them (VoxelType); the others become f32.
enum class StoredType { kU8, kI8, kU16, kI16, kU32, kI32, kU64, kI64, kF32, kF64 };
size_t stored_bytes(StoredType type);
const char* name_of(StoredType type);  ///< "u8" .. "f64"

/// f(T{}) with the C++ type of `type`.
template <class F>
decltype(auto) with_type(StoredType type, F&& f) {
  switch (type) {
    case StoredType::kU8:
      return f(uint8_t{});
    case StoredType::kI8:
      return f(int8_t{});
    case StoredType::kU16:
      return f(uint16_t{});
    case StoredType::kI16:
      return f(int16_t{});
    case StoredType::kU32:
      return f(uint32_t{});
    case StoredType::kI32:
      return f(int32_t{});
    case StoredType::kU64:
      return f(uint64_t{});
    case StoredType::kI64:
      return f(int64_t{});
    case StoredType::kF32:
      return f(float{});
    default:
      return f(double{});
  }
}

}  // namespace telesplat::data
