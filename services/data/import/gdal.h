// GDAL, in the program telesplat-import only: it may throw or crash on hostile files. It sees the files that were sent
// to this process, and no others.
#pragma once

#include <gdal.h>

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "services/data/base/elevation.h"
#include "services/data/base/progress.h"
#include "services/data/import/files.h"
#include "services/data/import/raster_facts.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {

/// Reads the raster `path` and the picture `texture` (empty: none), both among `files`. Errors name the file: no
/// raster, several bands (a picture), more samples than memory.
Result<ElevationRaster> read_elevation(ImportFiles& files, const std::string& path, const std::string& texture);

/// What it says of itself, and the heights that it holds.
Result<RasterFacts> read_raster_facts(ImportFiles& files, const std::string& path);

/// The voxels of all pages of all files, in native byte order. header: what stack_header() says of them. Error: a page
/// is damaged, or of another size.
Result<std::vector<std::byte>> read_stack(ImportFiles& files, const VolumeFileHeader& header,
                                          const ReadProgress& progress);

// Inside services/data/import: what is said to be an error is thrown as a Refusal.

struct CloseDataset {
  void operator()(void* dataset) const { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<void, CloseDataset>;

/// Formats of elevation. GDAL knows many more, and tells them by what a file holds, whatever its name is: some name
/// other files, on this machine or on others. A VRT's are those that we were given.
inline constexpr const char* kElevationDrivers[] = {
    "GTiff", "PNG", "SRTMHGT", "AAIGrid", "GRASSASCIIGrid", "USGSDEM", "DTED", "EHdr", "GSAG", "VRT", "XYZ", nullptr};
/// Formats of pictures. A file of theirs names no other file.
inline constexpr const char* kPictureDrivers[] = {"GTiff", "PNG", "JPEG", "JP2OpenJPEG", "WEBP",
                                                  "BMP",   "GIF", "PNM",  nullptr};

/// Registers the drivers above and shows GDAL the files. Error: none arrived.
void prepare_gdal(ImportFiles& files);
/// Where GDAL finds a file that was sent: in its memory files, which are the sent ones themselves.
std::string gdal_place_of(const std::string& path);
/// What GDAL complained of last, in one line that names files as they are.
std::string gdal_complaint();
/// Opens what lies at GDAL's `place`. path, what: for the error text.
Dataset open_with_gdal(const std::string& place, const std::string& path, const char* what, const char* const* drivers);

}  // namespace telesplat::data
