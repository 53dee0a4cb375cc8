// Finding and reading the files of a volume, and which part of it is served, and how.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "services/data/base/progress.h"
#include "services/data/base/volume.h"
#include "services/data/volume/formats/dicom.h"

namespace telesplat::data {

struct VolumeOptions : VolumeLayout {
  std::string transfer;  ///< as volume::resolve_transfer takes it; empty: what fits
  bool lit = true;
  /// Steps of a series a second; nothing: all of them in a second, at most 12.5; 0: it does not play.
  std::optional<double> steps_per_s;
  std::string part;     ///< "1/2": the second of two parts; empty: all of it
  int cache_mb = 2048;  ///< for the steps of a series that are kept
};

struct DicomSeries;

/// Files of one data set: what a layout and a path say. One file a time step.
struct VolumeSource {
  std::vector<std::string> steps;  ///< a file each, or a DICOM folder as often as its series has steps
  VolumeLayout layout{};
  std::string name{};                          ///< for people
  std::shared_ptr<const DicomSeries> dicom{};  ///< of a DICOM folder, file or disc
  std::vector<std::string> slices{};           ///< pictures in order (formats/stack.h), of a volume that these make

  /// All files that its voxels come from.
  std::vector<std::string> files() const;
};

/// Whether a path is (by content, then by name) a volume: a volume file, a DICOM file or folder, or a folder of
/// numbered volume files.
bool looks_like_volume(const std::string& path);
/// A volume file, a DICOM folder or file (dicom.h), or a folder with a numbered series of volume files
/// (phase00.nrrd, phase02.nrrd, ...), in order of their numbers; a TIFF file of several pages, or a folder with a
/// picture a slice. With `raw`, a raw file or a folder of numbered ones. series: of a DICOM folder alone.
/// Error: nothing of the kind; names path and what it is instead.
Result<VolumeSource> find_volume(const std::string& path, const VolumeLayout& layout = {});
/// Reads one step. Error: truncated, lying and mismatched headers (sizes against file
/// sizes), more than volume::kMaxSide on an axis, several components, types that are none of VoxelType's (wider ones
/// become f32 where that keeps them), memory. Names file, value and limit.
Result<Volume> read_volume(const VolumeSource& source, size_t step, const ReadProgress& progress);
/// Reads the headers of all steps, but no voxels. Error: as read_volume says of a header; a step whose size is not that
/// of the first.
Status check_steps(const VolumeSource& source);

/// Reads a step of a series: bits beside those stored are cleared (or carry the sign); slices that are stored or scaled
/// differently become f32; padding far from all other values becomes the lowest of them. What is compressed or coloured
/// is read by GDCM in the program telesplat-import. Error: files that changed, damaged pixels.
Result<Volume> read_dicom(const DicomSeries& series, size_t step, const std::string& path,
                          const ReadProgress& progress);

}  // namespace telesplat::data
