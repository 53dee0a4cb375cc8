// Voxels of a DICOM series.
#pragma once

#include <string>

#include "services/data/base/progress.h"
#include "services/data/base/volume.h"
#include "services/data/volume/formats/dicom_series.h"

namespace telesplat::data {

/// Reads a step of a series: bits beside those stored are cleared (or carry the sign); slices that are stored or scaled
/// differently become f32; padding far from all other values becomes the lowest of them. What is compressed or coloured
/// is read by GDCM in the program telesplat-import. Error: files that changed, damaged pixels.
Result<Volume> read_dicom(const DicomSeries& series, size_t step, const std::string& path,
                          const ReadProgress& progress);

}  // namespace telesplat::data
