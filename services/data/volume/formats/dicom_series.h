// A folder of DICOM slices as one volume.
#pragma once

#include <string>
#include <vector>

#include "services/data/base/progress.h"
#include "services/data/base/volume.h"
#include "services/data/volume/formats/dicom_header.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {

struct DicomSeries {
  VolumeFileHeader header;         ///< checked; patient space (left, posterior, superior), mm
  std::vector<DicomSlice> slices;  ///< in the order of k: along the normal that row and column directions have
  std::string remark;              ///< what was left out or evened, for people; often empty
};

/// The series of most slices among the DICOM files of a folder (not of its subfolders). Slices go by position, or by
/// instance number if they have none. Error: no slices; a damaged file among them; compressed, coloured and multi-frame
/// ones; slices of different sizes; two at the same position; gaps.
Result<DicomSeries> find_dicom_series(const std::string& folder);

/// Reads its voxels: bits above those stored are cleared (or carry the sign); slices with different rescaling become
/// f32.
Result<Volume> read_dicom(const std::string& folder, const ReadProgress& progress);

}  // namespace telesplat::data
