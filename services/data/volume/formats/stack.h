// Slices of a volume as pictures: a TIFF file of several pages, or a folder with one TIFF or PNG file per slice.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/data/volume/formats/header.h"

namespace telesplat::data {

struct TiffPages {
  int64_t width = 0, height = 0;   ///< size of the first page
  int64_t pages = 0;               ///< pages of that size, without reduced copies and masks; for ImageJ, its own count
  int channels = 1;                ///< per pixel
  std::optional<StoredType> type;  ///< nullopt: no type that voxels have
  bool placed = false;             ///< it has a position on earth: it is a raster
  /// ImageJ: all pages lie one behind the other from here on, uncompressed, with one page's directory.
  uint64_t data_at = 0;
  bool big_endian = false;
  glm::dvec3 spacing{1.0};
  std::string unit;  ///< unit of the spacing; empty: not given
};

/// Reads the directories of a TIFF or BigTIFF, at most 100,000 pages. nullopt: not a TIFF, or damaged. Source: Adobe,
/// "TIFF", Revision 6.0, 1992; "The BigTIFF File Format", AWare Systems.
std::optional<TiffPages> tiff_pages(std::string_view content);

/// True if a TIFF file is a stack: it has several pages of a size, or is one of ImageJ's, and has no position on earth.
bool is_stack(std::string_view content);

/// True if a file's first bytes are those of a TIFF or PNG: it may be a slice.
bool is_slice_picture(std::string_view start);

/// Returns the header of the volume of `files`, in order: x to the right, y down, z from slice to slice. One voxel is
/// one unit on each axis, or ImageJ's spacing. Its format is "stack". Reads the headers of all files. Error, naming the
/// file: colours, types that no voxel has, files of different sizes or types.
Result<VolumeFileHeader> stack_header(const std::vector<std::string>& files);

}  // namespace telesplat::data
