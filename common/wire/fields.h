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

/// Whether a message's fields that hold what a new one's hold are not sent, and others have their places in fields(),
/// from 0, for names. It says so itself: `static constexpr bool kBrief = true;`.
template <class M>
inline constexpr bool kIsBrief = false;
template <class M>
requires M::kBrief inline constexpr bool kIsBrief<M> = true;

inline constexpr double kMostMoment_us = 1125899906842624;  ///< 2^50, 35 years: seconds in f64 tell microseconds
inline constexpr uint32_t kShearNumbers = 11;               ///< of a shear frame before its layers
inline constexpr uint32_t kLayerNumbers = 3;                ///< of each layer

}  // namespace telesplat::wire
