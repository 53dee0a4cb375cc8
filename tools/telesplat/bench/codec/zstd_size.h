// How long zstd makes bytes, as a baseline.
#pragma once

#include <cstddef>
#include <span>

namespace telesplat::launcher {

/// Bytes of a frame of level 3, zstd's default.
size_t zstd_size(std::span<const std::byte> bytes);

}  // namespace telesplat::launcher
