// Memory that the allocator takes for a block, for truthful accounts.
#pragma once

#include <algorithm>
#include <cstddef>

namespace telesplat::points {

/// Bytes that glibc takes for a block: 8 before each, multiples of 16, at least 32.
constexpr size_t allocated_bytes(size_t bytes) {
  return bytes == 0 ? 0 : std::max<size_t>(32, (bytes + 8 + 15) / 16 * 16);
}

}  // namespace telesplat::points
