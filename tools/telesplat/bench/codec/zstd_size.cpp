#include "tools/telesplat/bench/codec/zstd_size.h"

#include <zstd.h>

#include <vector>

namespace telesplat::launcher {

size_t zstd_size(std::span<const std::byte> bytes) {
  constexpr int kLevel = 3;
  static thread_local std::vector<std::byte> packed;
  packed.resize(ZSTD_compressBound(bytes.size()));
  return ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kLevel);
}

}  // namespace telesplat::launcher
