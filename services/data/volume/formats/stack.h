// Slices of a volume as pictures: a TIFF file of several pages, or a folder with a TIFF or PNG file a slice.
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
  int64_t width = 0, height = 0;   ///< of the first page
  int64_t pages = 0;               ///< of that size, without reduced copies and masks; by ImageJ those that it says
  int channels = 1;                ///< a pixel
  std::optional<StoredType> type;  ///< none: of no type that voxels have
  bool placed = false;             ///< it says where on earth it lies: a raster
  /// By ImageJ: all pages lie behind each other from here on, without compression, behind one page's directory.
  uint64_t data_at = 0;
  bool big_endian = false;
  glm::dvec3 spacing{1.0};
  std::string unit;  ///< of the spacing; empty: not said
};

/// Walks through the directories of a TIFF or BigTIFF. None: it is no TIFF, or damaged. At most 100,000 pages are
/// looked at. Source: Adobe, "TIFF", Revision 6.0, 1992; "The BigTIFF File Format", AWare Systems.
std::optional<TiffPages> tiff_pages(std::string_view content);

/// Whether a TIFF file is a stack: it has several pages of a size, or is one of ImageJ's, and does not say where on
/// earth it lies.
bool is_stack(std::string_view content);

/// Whether a file may be a slice, by its first bytes: TIFF or PNG.
bool is_slice_picture(std::string_view start);

/// The volume that `files`, in order, are: x to the right, y down, z from slice to slice. One voxel a unit on each
/// axis, or what ImageJ says. Its format is "stack". Reads the headers of all files.
/// Error: colours, types that no voxel has, files of different sizes or types; it names the file.
Result<VolumeFileHeader> stack_header(const std::vector<std::string>& files);

}  // namespace telesplat::data
