// Calls GDAL, in the program telesplat-import only: it may throw or crash on hostile files. It sees the files that were
// sent to this process, and no others.
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

/// Reads the raster `path` and the picture `texture` (empty: no picture), both among `files`. Errors name the file: not
/// a raster, several bands (a picture), more samples than memory.
Result<ElevationRaster> read_elevation(ImportFiles& files, const std::string& path, const ElevationOptions& options);

/// Returns the raster's own description, and the range of its heights.
Result<RasterFacts> read_raster_facts(ImportFiles& files, const std::string& path);

/// Returns the voxels of all pages of all files, in native byte order. header: from stack_header(). Error: a page is
/// damaged, or of another size.
Result<std::vector<std::byte>> read_stack(ImportFiles& files, const VolumeFileHeader& header,
                                          const ReadProgress& progress);

// Inside services/data/import: functions throw errors as Refusals.

struct CloseDataset {
  void operator()(void* dataset) const { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<void, CloseDataset>;

/// Formats of elevation. GDAL knows many more, and recognises them by a file's content under any name: some of these
/// name other files, on this machine or on others. A VRT may name only files that were sent.
inline constexpr const char* kElevationDrivers[] = {
    "GTiff", "PNG", "SRTMHGT", "AAIGrid", "GRASSASCIIGrid", "USGSDEM", "DTED", "EHdr", "GSAG", "VRT", "XYZ", nullptr};
/// Formats of pictures. Their files name no other file.
inline constexpr const char* kPictureDrivers[] = {"GTiff", "PNG", "JPEG", "JP2OpenJPEG", "WEBP",
                                                  "BMP",   "GIF", "PNM",  nullptr};

/// Registers the drivers above and gives GDAL the files. Error: no file came.
void prepare_gdal(ImportFiles& files);
/// Returns the path under which GDAL finds a sent file: a memory file over the mapped bytes, without a copy.
std::string gdal_place_of(const std::string& path);
/// Returns GDAL's last error message, as one line with the files' own names.
std::string gdal_complaint();
/// Opens the file at GDAL's `place`. path, what: for the error text.
Dataset open_with_gdal(const std::string& place, const std::string& path, const char* what, const char* const* drivers);

}  // namespace telesplat::data
