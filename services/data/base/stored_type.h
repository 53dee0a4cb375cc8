// Types of numbers that files store.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace telesplat::data {

enum class StoredType { kU8, kI8, kU16, kI16, kU32, kI32, kU64, kI64, kF32, kF64 };
size_t stored_bytes(StoredType type);
const char* name_of(StoredType type);  ///< "u8" .. "f64"
/// Reverses the bytes of each number, to the other byte order.
void swap_bytes(std::span<std::byte> bytes, StoredType type);

/// Returns the integer type of 1, 2, 4 or 8 bytes.
constexpr StoredType whole_type(size_t bytes, bool is_signed) {
  const int row = bytes == 1 ? 0 : bytes == 2 ? 2 : bytes == 4 ? 4 : 6;
  return StoredType(row + is_signed);
}

/// A format's name for a type.
struct TypeName {
  std::string_view name;
  StoredType type;
};
/// Returns the type with this name; nullopt: the name is not in the list.
std::optional<StoredType> type_named(std::string_view name, std::span<const TypeName> names);

/// Returns f(T{}) with the C++ type of `type`.
template <class F>
[[gnu::always_inline]] inline decltype(auto) with_type(StoredType type, F&& f) {
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
