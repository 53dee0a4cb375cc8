#include "services/data/base/stored_type.h"

namespace telesplat::data {

size_t stored_bytes(StoredType type) {
  return with_type(type, [](auto v) { return sizeof v; });
}

const char* name_of(StoredType type) {
  constexpr const char* kNames[] = {"u8", "i8", "u16", "i16", "u32", "i32", "u64", "i64", "f32", "f64"};
  return kNames[static_cast<size_t>(type)];
}

}  // namespace telesplat::data
