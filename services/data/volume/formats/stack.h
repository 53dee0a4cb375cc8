// Slices of a volume as pictures: a TIFF file of several pages, or a folder with a TIFF or PNG file a slice.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "services/data/volume/formats/header.h"

namespace telesplat::data {

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
