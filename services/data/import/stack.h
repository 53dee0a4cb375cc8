// Slices as pictures, read by GDAL, in the program telesplat-import.
#pragma once

#include <cstddef>
#include <vector>

#include "services/data/base/progress.h"
#include "services/data/import/files.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {

/// The voxels of all pages of all files, in native byte order. header: what stack_header() says of them. Error: a page
/// is damaged, or of another size.
Result<std::vector<std::byte>> read_stack(ImportFiles& files, const VolumeFileHeader& header,
                                          const ReadProgress& progress);

}  // namespace telesplat::data
