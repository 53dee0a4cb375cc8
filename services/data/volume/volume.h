// A volume as files have it, before any transfer function.
#pragma once

#include <array>
#include <cstddef>
#include <glm/mat4x4.hpp>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"
#include "services/data/base/progress.h"

namespace telesplat::data {

enum class VoxelType { kU8, kI8, kU16, kI16, kF32 };
size_t voxel_bytes(VoxelType type);
const char* name_of(VoxelType type);  ///< "u8", "i8", "u16", "i16", "f32"

struct Volume {
  std::array<int, 3> size{};
  glm::dmat4 index_to_data{1.0};  ///< spacing, orientation and origin, in the file's own units and axes; affine
  VoxelType type = VoxelType::kU8;
  double scale = 1, offset = 0;  ///< value = stored * scale + offset (a CT's rescale, NIfTI's scl_slope)
  std::vector<std::byte>
      stored;          ///< i fastest, then j, k; native byte order; size[0] * size[1] * size[2] * voxel_bytes(type)
  std::string format;  ///< "nrrd", "metaimage", "nifti", "vti", "dicom", "raw"
  bool hounsfield = false;  ///< a CT, by what the file says or by its range
  double lo = 0, hi = 0;    ///< smallest and largest finite value
  uint64_t not_finite = 0;  ///< NaN and infinite ones; they count as lo
  std::string remark;       ///< for people: what was left out or evened (DICOM); often empty

  double value(size_t at) const;  ///< of voxel `at` in stored order
};

/// Files of one data set: what --raw and a path say. One file a time step.
struct VolumeSource {
  std::vector<std::string> steps;  ///< a file each, or one DICOM folder
  std::string raw;                 ///< --raw: "256x256x256:u8[:sx,sy,sz]"; empty: files tell themselves
  std::string name;                ///< for people
};

/// Whether a path is (by content, then by name) a volume: a volume file, a folder of DICOM slices, or a folder of numbered volume files.
bool looks_like_volume(const std::string& path);
/// A volume file, a DICOM folder, or a folder with a numbered series of volume files (phase00.nrrd, phase02.nrrd, ...), in order of their numbers. With
/// `raw`, a raw file or a folder of numbered ones. Error: nothing of the kind; names path and what it is instead.
Result<VolumeSource> find_volume(const std::string& path, const std::string& raw);
/// Reads one step. Formats that VTK reads are read in the program telesplat-import (vtk_reader.cpp), so that neither crashes nor claims of hostile files
/// reach us. Error: truncated, lying and mismatched headers (sizes against file sizes), more than volume::kMaxSide on an axis, several
/// components, types that are none of VoxelType's (wider ones become f32 where that keeps them), memory. Names file, value and limit.
Result<Volume> read_volume(const VolumeSource& source, size_t step, const ReadProgress& progress);
/// Reads the headers of all steps, but no voxels. Error: as read_volume says of a header; a step whose size is not that of the first.
Status check_steps(const VolumeSource& source);

}  // namespace telesplat::data
