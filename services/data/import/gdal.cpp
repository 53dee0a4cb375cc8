// Elevation rasters, read by GDAL: heights, where they lie on earth, and a texture draped over them.
#include <cpl_error.h>
#include <fmt/format.h>
#include <gdal.h>
#include <ogr_srs_api.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "common/core/utf8.h"
#include "services/data/base/elevation.h"
#include "services/data/import/raster_facts.h"

namespace telesplat::data {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kMaxSide = 1 << 18;

struct Close {
  void operator()(void* dataset) const { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<void, Close>;

// Formats of elevation. GDAL knows many more, and tells them by what a file holds, whatever its name is: some name
// other files, on this machine or on others.
constexpr const char* kElevationDrivers[] = {"GTiff",   "PNG",  "SRTMHGT", "AAIGrid", "GRASSASCIIGrid",
                                             "USGSDEM", "DTED", "EHdr",    "GSAG",    nullptr};

// Formats of textures. A file of theirs names no other file.
constexpr const char* kPictureDrivers[] = {"GTiff", "PNG", "JPEG", "JP2OpenJPEG", "WEBP", "BMP", "GIF", "PNM", nullptr};

Result<Dataset> open(const std::string& path, const char* what, const char* const* drivers) {
  Dataset dataset(GDALOpenEx(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, drivers, nullptr, nullptr));
  if (dataset) return dataset;
  std::string why = CPLGetLastErrorMsg();
  why = why.substr(0, std::min(why.find('\n'), size_t{200}));
  return Error{fmt::format("{}: cannot be read as {}: {}", path, what, why.empty() ? "GDAL does not know it" : why)};
}

// Where pixels lie. In degrees, or in some unit of length.
struct Placement {
  double transform[6] = {0, 1, 0, 0, 0, -1};  // corner of pixel (c, r): x = t0 + c t1 + r t2, y = t3 + c t4 + r t5
  bool georeferenced = false, degrees = false;
  bool south_up = false;  // the file's first row is the last one here
  double metres = 1;      // a unit of length
};

Placement placement_of(GDALDatasetH dataset) {
  Placement out;
  if (GDALGetGeoTransform(dataset, out.transform) != CE_None) return {};
  for (const double v : out.transform)
    if (!std::isfinite(v)) return {};
  if (out.transform[1] == 0 || out.transform[5] == 0) return {};
  out.south_up = out.transform[5] > 0;
  if (out.south_up) {
    out.transform[3] += out.transform[5] * GDALGetRasterYSize(dataset);
    out.transform[5] = -out.transform[5];
  }
  if (const OGRSpatialReferenceH reference = GDALGetSpatialRef(dataset)) {
    out.georeferenced = true;
    out.degrees = OSRIsGeographic(reference);
    if (!out.degrees) out.metres = OSRGetLinearUnits(reference, nullptr);
    if (!(out.metres > 0) || !std::isfinite(out.metres)) out.metres = 1;
  } else {
    // Without a reference system, but with coordinates that can only be degrees.
    const double *t = out.transform, w = GDALGetRasterXSize(dataset), h = GDALGetRasterYSize(dataset);
    out.degrees =
        t[0] >= -180.1 && t[0] + w * t[1] <= 180.1 && t[3] <= 90.1 && t[3] + h * t[5] >= -90.1 && std::abs(t[1]) < 0.5;
    out.georeferenced = out.degrees;
  }
  return out;
}

std::string line_of(const char* text) { return text ? std::string(text) : std::string(); }

// What the file's coordinates are called, and how long one of each is in metres.
scene::Coordinates coordinates_of(GDALDatasetH dataset, GDALRasterBandH band, const Placement& at,
                                  const glm::dvec3& shown) {
  scene::Coordinates out;
  if (!at.georeferenced || at.transform[2] != 0 || at.transform[4] != 0) return out;
  out.space = at.degrees ? scene::Space::kGeographic : scene::Space::kProjected;
  out.shown = out.lengths = shown;
  out.unit = at.degrees ? "degrees" : "m";
  out.height_unit = "m";
  if (const OGRSpatialReferenceH reference = GDALGetSpatialRef(dataset)) {
    out.reference = line_of(OSRGetName(reference));
    const std::string authority = line_of(OSRGetAuthorityName(reference, nullptr)),
                      code = line_of(OSRGetAuthorityCode(reference, nullptr));
    if (!authority.empty() && !code.empty()) out.reference = authority + ":" + code + " " + out.reference;
    char* unit = nullptr;
    OSRGetLinearUnits(reference, &unit);
    if (!at.degrees && at.metres != 1 && unit) out.unit = unit;
  }
  // Heights are shown as they are; feet say so.
  const std::string unit = line_of(GDALGetRasterUnitType(band));
  if (!unit.empty() && unit != "metre" && unit != "meter") out.height_unit = unit;
  for (const char* foot : {"ft", "foot", "feet", "US survey foot"})
    if (unit == foot) out.lengths.z = 0.3048;
  out.reference = to_utf8(out.reference.substr(0, scene::kMaxReference));
  out.unit = to_utf8(out.unit.substr(0, scene::kMaxUnit));
  out.height_unit = to_utf8(out.height_unit.substr(0, scene::kMaxUnit));
  return out;
}

// The texture's colours where the raster's samples are: by coordinates if both have them, else stretched over the
// raster.
Status drape(const std::string& path, const Placement& at, int full_width, int full_height, ElevationRaster& raster) {
  auto opened = open(path, "an image", kPictureDrivers);
  if (!opened) return opened.error();
  const GDALDatasetH image = opened->get();
  const int bands = GDALGetRasterCount(image), w = GDALGetRasterXSize(image), h = GDALGetRasterYSize(image);
  if (bands < 1 || w < 1 || h < 1 || w > kMaxSide || h > kMaxSide)
    return Error{fmt::format("{}: {} bands of {} x {} pixels, limit {}", path, bands, w, h, kMaxSide)};
  // No finer than the raster can show: at most twice its samples on each axis.
  const int tw = std::min(w, 2 * raster.width), th = std::min(h, 2 * raster.height);
  std::vector<uint8_t> texels(size_t(3) * size_t(tw) * size_t(th));
  for (int c = 0; c < 3; ++c) {
    const GDALRasterBandH band = GDALGetRasterBand(image, std::min(c, bands - 1) + 1);
    if (GDALGetRasterDataType(band) != GDT_Byte)
      return Error{fmt::format("{}: has {} channels, only 8-bit ones can be draped", path,
                               GDALGetDataTypeName(GDALGetRasterDataType(band)))};
    if (GDALRasterIO(band, GF_Read, 0, 0, w, h, texels.data() + c, tw, th, GDT_Byte, 3, 3 * tw) != CE_None)
      return Error{fmt::format("{}: cannot be read: {}", path, CPLGetLastErrorMsg())};
  }
  const Placement of = placement_of(image);
  const bool upside_down = of.south_up != at.south_up;
  const bool by_place = of.georeferenced && at.georeferenced && of.degrees == at.degrees;
  raster.colours.resize(raster.heights.size());
  for (int y = 0; y < raster.height; ++y)
    for (int x = 0; x < raster.width; ++x) {
      const double column = x * raster.step + 0.5, row = y * raster.step + 0.5;
      double fx = column / full_width, fy = row / full_height;
      if (by_place) {
        const double* t = at.transform;
        fx = (t[0] + column * t[1] - of.transform[0]) / (of.transform[1] * w);
        fy = (t[3] + row * t[5] - of.transform[3]) / (of.transform[5] * h);
      }
      const auto i = size_t(std::clamp(int(fx * tw), 0, tw - 1));
      const int down = std::clamp(int(fy * th), 0, th - 1);
      const auto j = size_t((by_place ? of.south_up : upside_down) ? th - 1 - down : down);
      const uint8_t* texel = &texels[3 * (j * size_t(tw) + i)];
      const bool inside = fx >= 0 && fx < 1 && fy >= 0 && fy < 1;
      raster.colours[size_t(y) * size_t(raster.width) + size_t(x)] =
          inside ? pack_rgb(texel[0], texel[1], texel[2]) : kNeutralAlbedo;
    }
  return ok_status();
}

// What is no elevation.
Status refuse_picture(GDALDatasetH dataset, const std::string& path) {
  if (const int bands = GDALGetRasterCount(dataset); bands != 1)
    return Error{fmt::format("{}: has {} bands: a picture, not an elevation raster, which has one", path, bands)};
  const GDALRasterBandH band = GDALGetRasterBand(dataset, 1);
  if (GDALDataTypeIsComplex(GDALGetRasterDataType(band)))
    return Error{fmt::format("{}: has complex samples, not heights", path)};
  if (GDALGetRasterDataType(band) != GDT_Byte) return ok_status();
  if (GDALGetRasterColorTable(band))
    return Error{fmt::format("{}: has a palette: a picture, not an elevation raster", path)};
  if (placement_of(dataset).georeferenced) return ok_status();
  return Error{
      fmt::format("{}: has samples of 8 bits and no place on earth: a picture, not an elevation raster; "
                  "--texture drapes it over one",
                  path)};
}

}  // namespace

Result<ElevationRaster> read_elevation(const std::string& path, const std::string& texture) {
  CPLSetErrorHandler(CPLQuietErrorHandler);
  GDALAllRegister();
  auto opened = open(path, "an elevation raster", kElevationDrivers);
  if (!opened) return opened.error();
  const GDALDatasetH dataset = opened->get();
  const int w = GDALGetRasterXSize(dataset), h = GDALGetRasterYSize(dataset);
  if (const Status s = refuse_picture(dataset, path); !s) return s.error();
  if (w < 2 || h < 2 || w > kMaxSide || h > kMaxSide)
    return Error{fmt::format("{}: a raster of {} x {} samples, limits 2 and {}", path, w, h, kMaxSide)};
  const GDALRasterBandH band = GDALGetRasterBand(dataset, 1);

  ElevationRaster out;
  while (int64_t{(w + out.step - 1) / out.step} * ((h + out.step - 1) / out.step) > kMaxRasterSamples) ++out.step;
  out.width = (w + out.step - 1) / out.step;
  out.height = (h + out.step - 1) / out.step;
  out.heights.resize(size_t(out.width) * size_t(out.height));
  std::vector<float> row(size_t(w), 0.0f);
  const Placement at = placement_of(dataset);
  int has_none = 0, has_scale = 0, has_offset = 0;
  const double none = GDALGetRasterNoDataValue(band, &has_none);
  const double scale = GDALGetRasterScale(band, &has_scale), offset = GDALGetRasterOffset(band, &has_offset);
  for (int y = 0; y < out.height; ++y) {
    const int from = at.south_up ? h - 1 - y * out.step : y * out.step;
    if (GDALRasterIO(band, GF_Read, 0, from, w, 1, row.data(), w, 1, GDT_Float32, 0, 0) != CE_None)
      return Error{fmt::format("{}: row {} of {} cannot be read: {}", path, from, h, CPLGetLastErrorMsg())};
    for (int x = 0; x < out.width; ++x) {
      float v = row[size_t(x) * size_t(out.step)];
      // -32768 and -9999 are what void samples usually have, said or not.
      const bool no_data =
          !std::isfinite(v) || (has_none && v == float(none)) || v == -32768.0f || v == -9999.0f || std::abs(v) > 1e9f;
      if (!no_data && has_scale) v *= float(scale);
      if (!no_data && has_offset) v += float(offset);
      out.heights[size_t(y) * size_t(out.width) + size_t(x)] = no_data ? std::numeric_limits<float>::quiet_NaN() : v;
    }
  }

  const double* t = at.transform;
  double east = at.metres, north = at.metres;  // metres a unit
  if (at.degrees) {
    const double latitude = (t[3] + t[5] * h / 2) * kPi / 180;
    east = 111'320 * std::max(std::cos(latitude), 0.01);
    north = 110'574;
  }
  out.georeferenced = at.georeferenced;
  // A sample stands in the middle of its pixel.
  out.dx = std::abs(t[1]) * east * out.step;
  out.dy = std::abs(t[5]) * north * out.step;
  out.x0 = (t[0] + t[1] / 2) * east;
  out.y0 = (t[3] + t[5] / 2) * north;
  out.coordinates = coordinates_of(dataset, band, at, {east, north, 1});
  if (!texture.empty())
    if (const Status s = drape(texture, at, w, h, out); !s) return s.error();
  return out;
}

Result<RasterFacts> read_raster_facts(const std::string& path) {
  const auto raster = read_elevation(path, "");
  if (!raster) return raster.error();
  auto opened = open(path, "an elevation raster", kElevationDrivers);
  if (!opened) return opened.error();
  const GDALDatasetH dataset = opened->get();
  RasterFacts out;
  out.format = GDALGetDriverLongName(GDALGetDatasetDriver(dataset));
  out.type = GDALGetDataTypeName(GDALGetRasterDataType(GDALGetRasterBand(dataset, 1)));
  out.width = GDALGetRasterXSize(dataset), out.height = GDALGetRasterYSize(dataset);
  out.step = raster->step;
  const Placement at = placement_of(dataset);
  const double* t = at.transform;
  if (const OGRSpatialReferenceH reference = GDALGetSpatialRef(dataset)) {
    if (const char* name = OSRGetName(reference)) out.reference = name;
    char* unit = nullptr;
    OSRGetLinearUnits(reference, &unit);
    out.unit = at.degrees ? "degrees" : at.metres == 1 || !unit ? "metres" : unit;
  } else if (at.degrees) {
    out.unit = "degrees";
  }
  const double x1 = t[0] + t[1] * out.width, y1 = t[3] + t[5] * out.height;
  out.west = std::min(t[0], x1), out.east = std::max(t[0], x1);
  out.south = std::min(t[3], y1), out.north = std::max(t[3], y1);
  out.sample_x = std::abs(t[1]), out.sample_y = std::abs(t[5]);
  out.sample_x_m = raster->dx / raster->step, out.sample_y_m = raster->dy / raster->step;
  out.lo = HUGE_VAL, out.hi = -HUGE_VAL;
  for (const float z : raster->heights)
    if (std::isfinite(z))
      out.lo = std::min(out.lo, double(z)), out.hi = std::max(out.hi, double(z));
    else
      ++out.without_data;
  if (out.lo > out.hi) return Error{fmt::format("{}: none of its samples has data", path)};
  return out;
}

}  // namespace telesplat::data
