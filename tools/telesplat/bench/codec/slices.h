// The codec of slice images (common/volume/slices), over views of a volume.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"
#include "services/data/data_options.h"
#include "tools/telesplat/bench/codec/frames.h"
#include "tools/telesplat/bench/codec/speed.h"

namespace telesplat::launcher {

struct SliceReport {
  std::string name;
  size_t views = 0, images = 0;
  size_t pixels = 0;                ///< of the images' rectangles
  size_t covered = 0;               ///< that are not transparent
  size_t bits = 0, zstd_bits = 0;   ///< zstd -3: an image's pixels in blocks of 64 x 64, those with anything in them
  size_t wrong = 0;                 ///< pixels that came back otherwise
  std::vector<TargetSpeed> speeds;  ///< of pixels that are not transparent
};

/// Views are sampled as one sampler does it that has all of the volume. seconds: as CodecMeasure has it. Error: names
/// file and what is wrong.
Result<SliceReport> measure_slices(const data::DataOptions& data, const ViewOptions& views, double seconds,
                                   const ShowProgress& progress);

}  // namespace telesplat::launcher
