// JPEG XL as a baseline, by the program cjxl where it is installed.
#pragma once

#include <string>

#include "tools/telesplat/bench/codec/baselines.h"

namespace telesplat::launcher {

/// Empty: cjxl is there.
std::string why_no_jpeg_xl();

/// Lossless, effort 3, a process a picture. Error: what cjxl complained of. Precondition: cjxl is there.
Result<PlaneBits> jpeg_xl_bits(const image::DepthImage& image);

}  // namespace telesplat::launcher
