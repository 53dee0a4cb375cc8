// Constants and concepts that Encoder and Decoder share. Private to this library.
#pragma once

#include <cstdint>

namespace telesplat::wire {

struct AnyVisitor {};

/// A struct with fields(): a message, or a part of one. It is a map on the wire.
template <class M>
concept Struct = requires(AnyVisitor f, M& m) {
  M::fields(f, m);
};

/// True for a brief message: it omits fields that hold their default, and keys the others by their place in fields(),
/// from 0, instead of by name. The message declares it: `static constexpr bool kBrief = true;`.
template <class M>
inline constexpr bool kIsBrief = false;
template <class M>
requires M::kBrief inline constexpr bool kIsBrief<M> = true;

inline constexpr double kMostMoment_us = 1125899906842624;  ///< 2^50, 35 years: seconds in f64 resolve microseconds
inline constexpr uint32_t kShearNumbers = 11;               ///< numbers of a shear frame before its layers
inline constexpr uint32_t kLayerNumbers = 3;                ///< numbers of each layer

}  // namespace telesplat::wire
