#include "services/data/import/gdal.h"

#include <cpl_error.h>
#include <cpl_vsi.h>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "services/data/base/refusal.h"
#include "services/data/volume/formats/stack.h"

namespace telesplat::data {
namespace {

GDALDataType type_of(StoredType type) {
  // GDAL 3.6 marks signed bytes only by metadata; their bits are the same.
  constexpr GDALDataType kTypes[] = {GDT_Byte,  GDT_Byte,    GDT_UInt16,  GDT_Int16,   GDT_UInt32,
                                     GDT_Int32, GDT_Float64, GDT_Float64, GDT_Float32, GDT_Float64};
  return kTypes[size_t(type)];
}

std::vector<std::byte> stack_of(ImportFiles& files, const VolumeFileHeader& header, const ReadProgress& progress) {
  prepare_gdal(files);
  const int w = int(header.size[0]), h = int(header.size[1]);
  const size_t page_bytes = size_t(w) * size_t(h) * stored_bytes(header.stored);
  std::vector<std::byte> out;
  out.reserve(header.voxel_bytes());
  for (const ImportFile& file : files.all()) {
    const auto content = need(files.content_of(file));
    const auto pages = tiff_pages(content);
    int64_t left = pages ? pages->pages : 1;
    for (int page = 1; left > 0; ++page) {
      const std::string place = gdal_place_of(file.path());
      const auto picture = (open_with_gdal(pages ? fmt::format("GTIFF_DIR:{}:{}", page, place) : place, file.path(),
                                           "a slice", kPictureDrivers));
      if (GDALGetRasterXSize(picture.get()) != w || GDALGetRasterYSize(picture.get()) != h) {
        if (pages) continue;  // a reduced copy of a page
        refuse("{}: is of another size than its header says", file.path());
      }
      if (out.size() + page_bytes > header.voxel_bytes())
        refuse("{}: holds more pages than its header says", file.path());
      out.resize(out.size() + page_bytes);
      if (GDALRasterIO(GDALGetRasterBand(picture.get(), 1), GF_Read, 0, 0, w, h, out.data() + out.size() - page_bytes,
                       w, h, type_of(header.stored), 0, 0) != CE_None)
        refuse("{}: page {} cannot be read: {}", file.path(), page, gdal_complaint());
      --left;
      progress(double(out.size()) / double(header.voxel_bytes()));
    }
  }
  if (out.size() != header.voxel_bytes()) throw Refusal{"fewer pages than their headers say"};
  return out;
}

}  // namespace

std::string gdal_place_of(const std::string& path) {
  return "/vsimem/" + std::filesystem::absolute(path).lexically_normal().relative_path().string();
}

// Removes all other drivers, so that none of them reads a file that a VRT names.
void prepare_gdal(ImportFiles& files) {
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
    if (!content) continue;  // an empty file, for example
    // GDAL only reads these bytes: the mappings are read-only.
    auto* const bytes = reinterpret_cast<GByte*>(const_cast<char*>(content->data()));
    if (VSILFILE* memory = VSIFileFromMemBuffer(gdal_place_of(file.path()).c_str(), bytes, content->size(), FALSE))
      VSIFCloseL(memory);
  }
}

// Returns GDAL's last error message, as one line with the files' own names.
std::string gdal_complaint() {
  std::string why = CPLGetLastErrorMsg();
  for (size_t at; (at = why.find("/vsimem/")) != why.npos;) why.erase(at, 7);
  why = why.substr(0, std::min(why.find('\n'), size_t{200}));
  return why.empty() ? "GDAL does not know it" : why;
}

Dataset open_with_gdal(const std::string& place, const std::string& path, const char* what,
                       const char* const* drivers) {
  Dataset dataset(GDALOpenEx(place.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, drivers, nullptr, nullptr));
  if (!dataset) refuse("{}: cannot be read as {}: {}", path, what, gdal_complaint());
  return dataset;
}

Result<std::vector<std::byte>> read_stack(ImportFiles& files, const VolumeFileHeader& header,
                                          const ReadProgress& progress) {
  return or_error([&] { return stack_of(files, header, progress); });
}

}  // namespace telesplat::data
