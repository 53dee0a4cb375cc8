#include "services/data/import/stack.h"

#include <fmt/format.h>

#include "services/data/import/gdal_files.h"
#include "services/data/volume/formats/tiff_pages.h"

namespace telesplat::data {
namespace {

GDALDataType type_of(StoredType type) {
  switch (type) {
    case StoredType::kU8:
      return GDT_Byte;
    case StoredType::kI8:
      return GDT_Byte;  // GDAL 3.6 tells signed bytes by a remark alone; their bits are the same
    case StoredType::kU16:
      return GDT_UInt16;
    case StoredType::kI16:
      return GDT_Int16;
    case StoredType::kU32:
      return GDT_UInt32;
    case StoredType::kI32:
      return GDT_Int32;
    case StoredType::kF32:
      return GDT_Float32;
    default:
      return GDT_Float64;
  }
}

}  // namespace

Result<std::vector<std::byte>> read_stack(ImportFiles& files, const VolumeFileHeader& header,
                                          const ReadProgress& progress) {
  if (const Status s = prepare_gdal(files); !s) return s.error();
  const int w = int(header.size[0]), h = int(header.size[1]);
  const size_t page_bytes = size_t(w) * size_t(h) * stored_bytes(header.stored);
  std::vector<std::byte> out;
  out.reserve(header.voxel_bytes());
  for (const ImportFile& file : files.all()) {
    const auto content = files.content_of(file);
    if (!content) return content.error();
    const auto pages = tiff_pages(*content);
    int64_t left = pages ? pages->pages : 1;
    for (int page = 1; left > 0; ++page) {
      const std::string place = gdal_place_of(file.path());
      const auto picture = open_with_gdal(pages ? fmt::format("GTIFF_DIR:{}:{}", page, place) : place, file.path(),
                                          "a slice", kPictureDrivers);
      if (!picture) return picture.error();
      if (GDALGetRasterXSize(picture->get()) != w || GDALGetRasterYSize(picture->get()) != h) {
        if (pages) continue;  // a reduced copy
        return Error{fmt::format("{}: is of another size than its header says", file.path())};
      }
      if (out.size() + page_bytes > header.voxel_bytes())
        return Error{fmt::format("{}: holds more pages than its header says", file.path())};
      out.resize(out.size() + page_bytes);
      if (GDALRasterIO(GDALGetRasterBand(picture->get(), 1), GF_Read, 0, 0, w, h, out.data() + out.size() - page_bytes,
                       w, h, type_of(header.stored), 0, 0) != CE_None)
        return Error{fmt::format("{}: page {} cannot be read: {}", file.path(), page, gdal_complaint())};
      --left;
      progress(double(out.size()) / double(header.voxel_bytes()));
    }
  }
  if (out.size() != header.voxel_bytes()) return Error{"fewer pages than their headers say"};
  return out;
}

}  // namespace telesplat::data
