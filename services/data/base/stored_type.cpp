#include "services/data/base/stored_type.h"

#include <algorithm>
#include <cstring>

namespace telesplat::data {
namespace {

template <class T, class Swap>
void swap_all(std::span<std::byte> bytes, Swap swap) {
  for (size_t at = 0; at + sizeof(T) <= bytes.size(); at += sizeof(T)) {
    T v;
    std::memcpy(&v, bytes.data() + at, sizeof v);
    v = swap(v);
    std::memcpy(bytes.data() + at, &v, sizeof v);
  }
}

}  // namespace

void swap_bytes(std::span<std::byte> bytes, StoredType type) {
  const size_t size = stored_bytes(type);
  if (size == 2) swap_all<uint16_t>(bytes, [](uint16_t v) { return __builtin_bswap16(v); });
  if (size == 4) swap_all<uint32_t>(bytes, [](uint32_t v) { return __builtin_bswap32(v); });
  if (size == 8) swap_all<uint64_t>(bytes, [](uint64_t v) { return __builtin_bswap64(v); });
}

size_t stored_bytes(StoredType type) {
  return with_type(type, [](auto v) { return sizeof v; });
}

const char* name_of(StoredType type) {
  constexpr const char* kNames[] = {"u8", "i8", "u16", "i16", "u32", "i32", "u64", "i64", "f32", "f64"};
  return kNames[static_cast<size_t>(type)];
}

std::optional<StoredType> type_named(std::string_view name, std::span<const TypeName> names) {
  const auto found = std::find_if(names.begin(), names.end(), [&](const TypeName& n) { return n.name == name; });
  return found == names.end() ? std::nullopt : std::optional(found->type);
}

}  // namespace telesplat::data
