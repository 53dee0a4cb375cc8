// A series of DICOM slices as one volume.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "services/data/volume/formats/dicom_order.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {

/// One of the series in a folder, for people to choose from.
struct DicomSeriesName {
  std::string uid, text, modality;
  size_t slices = 0;
  int columns = 0, rows = 0;
};

struct DicomSeries {
  VolumeFileHeader header;  ///< of each step; checked; patient space (left, posterior, superior), mm
  DicomOrder order;         ///< its remark tells all that was left out or evened, for people
  /// All series of the folder, by Series Number, then by UID; and which of them this is.
  std::vector<DicomSeriesName> all;
  size_t taken = 0;
  /// The files of its slices, by name.
  std::vector<std::string> files() const;
};

/// "2: AXIAL T1, MR, 40 slices of 512 x 512": its place in the folder, from 1, and what it is.
std::string text_of(const DicomSeriesName& series, size_t place);

/// Whether a folder holds DICOM slices: in itself, or below where it holds none.
bool holds_dicom(const std::string& folder);

/// A series among the DICOM files of a folder; of the folders below, too, if it has a DICOMDIR or no slices of its own
/// (100,000 files, 8 folders deep). `path`: the folder, its DICOMDIR, or one of its slices, whose series it is then.
/// `which`: its place in the list, from 1, or its UID; empty: the one of most slices. Error: no slices, no such series;
/// values that are not 8 to 64 bits wide; rescaling by 0. Files that are cut or damaged are left out with a remark.
Result<std::shared_ptr<const DicomSeries>> find_dicom_series(const std::string& path, const std::string& which = "");

/// How a slice's values are stored, before any are cleared of what lies beside their bits.
StoredType stored_type(const DicomSlice& slice);
/// Whether low values are bright, and have no scale to keep: they are turned round.
bool is_inverted(const DicomSlice& slice);

}  // namespace telesplat::data
