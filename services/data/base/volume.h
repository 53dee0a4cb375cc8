// A volume as readers return it: as its file has it, before any transfer function.
#pragma once

#include <array>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <string>
#include <vector>

#include "common/geometry/box.h"
#include "common/scene/placement.h"
#include "services/data/base/stored_type.h"

namespace telesplat::data {

struct VolumeLayout {
  std::string raw;      ///< --raw: "256x256x256:u8[:sx,sy,sz][:skip=bytes]"; empty: the file states its layout
  std::string series;   ///< --series: one of a DICOM folder's; empty: the one with most slices
  std::string spacing;  ///< --spacing: "x,y,z" of voxels; empty: the file's
  std::string array;    ///< --array: one of a file's named arrays; empty: the one that it marks, else the first

  /// All four in one string, for names of stores; empty: all are empty.
  std::string text() const {
    const std::string out = raw + "\n" + series + "\n" + spacing + "\n" + array;
    return out == "\n\n\n" ? "" : out;
  }
};

/// One of kU8, kI8, kU16, kI16 and kF32; readers convert other types to kF32.
using VoxelType = StoredType;
inline size_t voxel_bytes(VoxelType type) { return stored_bytes(type); }

struct Volume {
  std::array<int, 3> size{};
  glm::dmat4 index_to_data{1.0};  ///< spacing, orientation and origin, in the file's own units and axes; affine
  std::string unit;               ///< unit of these: "mm", "m", ...; empty: the file does not say
  scene::Space space = scene::Space::kPlain;  ///< kind of these axes
  VoxelType type = VoxelType::kU8;
  double scale = 1, offset = 0;  ///< value = stored * scale + offset (a CT's rescale, NIfTI's scl_slope)
  /// i fastest, then j, k; native byte order; size[0] * size[1] * size[2] * voxel_bytes(type) bytes.
  std::vector<std::byte> stored;
  std::string format;       ///< "nrrd", "metaimage", "nifti", "vti", "vtk", "dicom", "raw"
  bool hounsfield = false;  ///< a CT, according to the file or to its range
  double lo = 0, hi = 0;    ///< smallest and largest finite value
  uint64_t not_finite = 0;  ///< NaN and infinite ones; they count as lo
  std::string remark;       ///< for users: slices that were left out or adjusted (DICOM); often empty
  std::string array{};      ///< the array's name, if the file names arrays

  double value(size_t at) const;  ///< value of voxel `at` in stored order
  /// Returns the box of all voxels, from edge to edge, in the file's own units: the box that is centred in the room.
  geometry::DBox box() const;
};

}  // namespace telesplat::data
