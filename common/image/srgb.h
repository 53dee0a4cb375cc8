// The sRGB curve (IEC 61966-2-1).
#pragma once

#include <array>
#include <cstdint>

namespace telesplat::image {

/// Linear intensity, 0..1, of each 8-bit code.
const std::array<float, 256>& linear_of_srgb();

/// The code whose intensity is nearest on the curve. Below 0 and NaN: 0; above 1: 255.
uint32_t srgb_of_linear(float v);

}  // namespace telesplat::image
