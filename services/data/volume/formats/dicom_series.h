// A folder of DICOM slices as one volume.
#pragma once

#include <string>
#include <vector>

#include "services/data/base/progress.h"
#include "services/data/base/volume.h"
#include "services/data/volume/formats/dicom_header.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {

/// One of the series in a folder, for people to choose from.
struct DicomSeriesName {
  std::string uid, text, modality;
  size_t slices = 0;
  int columns = 0, rows = 0;
};

struct DicomSeries {
  VolumeFileHeader header;         ///< checked; patient space (left, posterior, superior), mm
  std::vector<DicomSlice> slices;  ///< in the order of k: along the normal that row and column directions have
  std::string remark;              ///< what was left out or evened, for people; often empty
  /// All series of the folder, by Series Number, then by UID; and which of them this is.
  std::vector<DicomSeriesName> all;
  size_t taken = 0;
};

/// "2: AXIAL T1, MR, 40 slices of 512 x 512": its place in the folder, from 1, and what it is.
std::string text_of(const DicomSeriesName& series, size_t place);

/// A series among the DICOM files of a folder (not of its subfolders): `which` is its place in the list, from 1, or its
/// UID; empty: the one of most slices. Slices go by position, or by instance number if they have none. Error: no
/// slices, no such series; a damaged file among them; compressed, coloured and multi-frame ones; slices of different
/// sizes; two at the same position; gaps.
Result<DicomSeries> find_dicom_series(const std::string& folder, const std::string& which = "");

/// Reads its voxels: bits above those stored are cleared (or carry the sign); slices with different rescaling become
/// f32.
Result<Volume> read_dicom(const std::string& folder, const std::string& which, const ReadProgress& progress);

}  // namespace telesplat::data
