// JPEG pictures, as in remote desktops (libjpeg-turbo).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/result.h"

namespace telesplat::image {

/// Least quality at which colours keep all pixels (4:4:4); below, they keep every second pixel of every second row
/// (4:2:0), which is hardly visible at these qualities.
inline constexpr int kFullChromaFrom = 95;

/// colour: 0x00RRGGBB, row after row. Preconditions: width x height colours, at least one; quality 1 to 100.
std::vector<std::byte> encode_jpeg(std::span<const uint32_t> colour, int width, int height, int quality);

/// Decodes a picture of this size to `to`, whose rows begin `stride` colours apart; the upper byte of each colour is
/// undefined. Error: not a JPEG picture of this size; colours may have been written then. Bytes may come from outside.
Status decode_jpeg(std::span<const std::byte> jpeg, int width, int height, uint32_t* to, int stride);

}  // namespace telesplat::image
