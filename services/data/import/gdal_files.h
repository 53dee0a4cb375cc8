// GDAL, as telesplat-import uses it: it sees the files that were sent to this process, and no others.
#pragma once

#include <gdal.h>

#include <memory>
#include <string>

#include "services/data/import/files.h"

namespace telesplat::data {

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
Status prepare_gdal(ImportFiles& files);
/// Where GDAL finds a file that was sent: in its memory files, which are the sent ones themselves.
std::string gdal_place_of(const std::string& path);
/// What GDAL complained of last, in one line that names files as they are.
std::string gdal_complaint();
/// Opens what lies at GDAL's `place`. path, what: for the error text.
Result<Dataset> open_with_gdal(const std::string& place, const std::string& path, const char* what,
                               const char* const* drivers);

}  // namespace telesplat::data
