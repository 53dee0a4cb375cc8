// A value within bounds that are calculated: std::clamp ends the program where they cross.
#pragma once

#include <algorithm>

namespace telesplat {

/// `value`, or the bound that it lies beyond, whichever bound is the lower one. A value that is no number stays.
template <class T>
constexpr T within(T value, T one, T other) {
  return std::min(std::max(value, std::min(one, other)), std::max(one, other));
}

}  // namespace telesplat
