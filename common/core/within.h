// Brings a value between two bounds that are calculated: std::clamp has undefined behaviour if they cross.
#pragma once

#include <algorithm>

namespace telesplat {

/// Returns `value`, or the bound that it lies beyond; either bound may be the lower one. Keeps a value that is NaN.
template <class T>
constexpr T within(T value, T one, T other) {
  return std::min(std::max(value, std::min(one, other)), std::max(one, other));
}

}  // namespace telesplat
