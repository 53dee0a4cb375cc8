// What Encoder and Decoder agree on. Private to this library.
#pragma once

#include <cstdint>

namespace telesplat::wire {

struct AnyVisitor {};

/// A struct with fields(): a message, or a part of one. It is a map on the wire.
template <class M>
concept Struct = requires(AnyVisitor f, M& m) {
  M::fields(f, m);
};

inline constexpr uint32_t kShearNumbers = 11;  ///< of a shear frame before its layers
inline constexpr uint32_t kLayerNumbers = 3;   ///< of each layer

}  // namespace telesplat::wire
