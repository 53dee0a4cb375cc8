// Finds and reads the files of a volume; options for serving it.
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
  std::string transfer;  ///< as volume::resolve_transfer takes it; empty: chosen by the data
  bool lit = true;
  /// Steps of a series per second; nullopt: all of them in a second, at most 12.5; 0: it does not play.
  std::optional<double> steps_per_s;
  std::string part;     ///< "1/2": the second of two parts; empty: the whole volume
  int cache_mb = 2048;  ///< for the kept steps of a series
};

struct DicomSeries;

/// Files of one data set, found by path and layout. One file per time step.
struct VolumeSource {
  std::vector<std::string> steps;  ///< one file each; for DICOM the folder, once per step of its series
  VolumeLayout layout{};
  std::string name{};                          ///< for users
  std::shared_ptr<const DicomSeries> dicom{};  ///< for a DICOM folder, file or disc
  std::vector<std::string> slices{};           ///< pictures in order (formats/stack.h), if the volume consists of these

  /// Returns all files that its voxels come from.
  std::vector<std::string> files() const;
};

/// True if a path is a volume, by content, then by name: a volume file, a DICOM file or folder, or a folder of numbered
/// volume files.
bool looks_like_volume(const std::string& path);
/// Finds a volume file, a DICOM folder or file (dicom.h), or a folder with a numbered series of volume files
/// (phase00.nrrd, phase02.nrrd, ...), in order of their numbers; a TIFF file of several pages, or a folder with a
/// picture per slice. With `raw`, a raw file or a folder of numbered ones. series: for DICOM folders only. Error: no
/// volume; names the path and its likely kind.
Result<VolumeSource> find_volume(const std::string& path, const VolumeLayout& layout = {});
/// Reads one step. Error, naming file, value and limit: truncated files, false and mismatched headers (sizes against
/// file sizes), more than volume::kMaxSide on an axis, several components, values that VoxelType cannot hold
/// (make_volume()), too little memory.
Result<Volume> read_volume(const VolumeSource& source, size_t step, const ReadProgress& progress);
/// Reads the headers of all steps, but no voxels. Error: a header's, as in read_volume; a step of another size than the
/// first.
Status check_steps(const VolumeSource& source);

/// Reads a step of a series: unused bits beside the stored ones are cleared (or carry the sign); slices stored or
/// scaled differently become f32; padding far from all other values becomes the lowest of them. Compressed or coloured
/// pixels are decoded by GDCM in the program telesplat-import. Error: files that changed, damaged pixels.
Result<Volume> read_dicom(const DicomSeries& series, size_t step, const std::string& path,
                          const ReadProgress& progress);

}  // namespace telesplat::data
