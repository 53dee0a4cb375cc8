#include "services/data/import/gdal_files.h"

#include <cpl_error.h>
#include <cpl_vsi.h>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace telesplat::data {

std::string gdal_place_of(const std::string& path) {
  return "/vsimem/" + std::filesystem::absolute(path).lexically_normal().relative_path().string();
}

// Other drivers go, so that no file of a VRT is read by one of them.
Status prepare_gdal(ImportFiles& files) {
  CPLSetErrorHandler(CPLQuietErrorHandler);
  GDALAllRegister();
  const auto listed = [](const char* name, const char* const* drivers) {
    for (; *drivers; ++drivers)
      if (std::string_view(name) == *drivers) return true;
    return false;
  };
  for (int i = GDALGetDriverCount() - 1; i >= 0; --i) {
    const GDALDriverH driver = GDALGetDriver(i);
    const char* const name = GDALGetDriverShortName(driver);
    if (!listed(name, kElevationDrivers) && !listed(name, kPictureDrivers)) GDALDeregisterDriver(driver);
  }
  for (const ImportFile& file : files.all()) {
    const auto content = files.content_of(file);
    if (!content) continue;  // empty, for one
    // GDAL reads them alone: they are open for nothing else.
    auto* const bytes = reinterpret_cast<GByte*>(const_cast<char*>(content->data()));
    if (VSILFILE* memory = VSIFileFromMemBuffer(gdal_place_of(file.path()).c_str(), bytes, content->size(), FALSE))
      VSIFCloseL(memory);
  }
  return files.all().empty() ? Status(Error{"no file arrived"}) : ok_status();
}

// What GDAL complained of last, in one line that names files as they are.
std::string gdal_complaint() {
  std::string why = CPLGetLastErrorMsg();
  for (size_t at; (at = why.find("/vsimem/")) != why.npos;) why.erase(at, 7);
  why = why.substr(0, std::min(why.find('\n'), size_t{200}));
  return why.empty() ? "GDAL does not know it" : why;
}

Result<Dataset> open_with_gdal(const std::string& place, const std::string& path, const char* what,
                               const char* const* drivers) {
  Dataset dataset(GDALOpenEx(place.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, drivers, nullptr, nullptr));
  if (dataset) return dataset;
  return Error{fmt::format("{}: cannot be read as {}: {}", path, what, gdal_complaint())};
}

}  // namespace telesplat::data
