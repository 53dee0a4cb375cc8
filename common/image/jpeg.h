// JPEG, as remote desktops send pictures (libjpeg-turbo).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/result.h"

namespace telesplat::image {

/// Quality of pictures whose colours keep all pixels (4:4:4); at lower ones colours have every second pixel of every
/// second row (4:2:0), which the eye hardly sees at these qualities.
inline constexpr int kFullChromaFrom = 95;

/// colour: 0x00RRGGBB, rows follow each other. Preconditions: width x height colours, at least one; quality 1 to 100.
std::vector<std::byte> encode_jpeg(std::span<const uint32_t> colour, int width, int height, int quality);

/// Decodes a picture of this size to `to`, whose rows begin `stride` colours apart; the upper byte of each is void.
/// Error: it is not a JPEG picture of this size; colours may have been written then. Bytes may come from outside.
Status decode_jpeg(std::span<const std::byte> jpeg, int width, int height, uint32_t* to, int stride);

}  // namespace telesplat::image
