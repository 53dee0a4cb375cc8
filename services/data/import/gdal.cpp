// Reads elevation rasters by GDAL: heights, their position on earth, and a texture draped over them.
#include <fmt/format.h>
#include <ogr_srs_api.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

#include "common/core/utf8.h"
#include "common/core/within.h"
#include "services/data/base/refusal.h"
#include "services/data/base/text_scanner.h"
#include "services/data/import/gdal.h"

namespace telesplat::data {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kMaxSide = 1 << 18;

// Position of pixels: in degrees, or in a unit of length.
struct Placement {
  double transform[6] = {0, 1, 0, 0, 0, -1};  // corner of pixel (c, r): x = t0 + c t1 + r t2, y = t3 + c t4 + r t5
  bool georeferenced = false, degrees = false;
  bool reference = false;  // the file names its reference system
  double metres = 1;       // length of the unit, m
  std::string unit;        // its name; empty: not given

  glm::dvec2 at(double column, double row) const {
    const double* t = transform;
    return {t[0] + column * t[1] + row * t[2], t[3] + column * t[4] + row * t[5]};
  }
};

Placement placement_of(GDALDatasetH dataset) {
  Placement out;
  if (GDALGetGeoTransform(dataset, out.transform) != CE_None) return {};
  const double* t = out.transform;
  for (int i = 0; i < 6; ++i)
    if (!std::isfinite(t[i])) return {};
  if (t[1] * t[5] - t[2] * t[4] == 0) return {};
  out.georeferenced = true;
  if (const OGRSpatialReferenceH reference = GDALGetSpatialRef(dataset)) {
    out.reference = true;
    out.degrees = OSRIsGeographic(reference);
    char* unit = nullptr;
    if (!out.degrees) out.metres = OSRGetLinearUnits(reference, &unit);
    if (!(out.metres > 0) || !std::isfinite(out.metres)) out.metres = 1;
    out.unit = out.degrees ? "degrees" : out.metres == 1 || !unit ? "metres" : unit;
  } else {
    // No reference system, but coordinates that can only be degrees.
    const double w = GDALGetRasterXSize(dataset), h = GDALGetRasterYSize(dataset);
    const glm::dvec2 a = out.at(0, 0), b = out.at(w, h);
    out.degrees = std::max(std::abs(a.x), std::abs(b.x)) <= 180.1 && std::max(std::abs(a.y), std::abs(b.y)) <= 90.1 &&
                  std::abs(t[1]) < 0.5;
    if (out.degrees) out.unit = "degrees";
  }
  return out;
}

std::string line_of(const char* text) { return text ? std::string(text) : std::string(); }

// Name of the unit of the file's heights, and its length in metres.
struct HeightUnit {
  std::string name = "m";
  double metres = 1;
  std::string from;  // the source of this unit
};

std::optional<double> metres_of(const std::string& name) {
  constexpr double kFoot = 0.3048, kSurveyFoot = 1200.0 / 3937;
  constexpr std::pair<std::string_view, double> kUnits[] = {
      {"|m|metre|metres|meter|meters|", 1},
      {"|mm|", 0.001},
      {"|cm|centimetre|", 0.01},
      {"|dm|decimetre|", 0.1},
      {"|km|kilometre|", 1000},
      {"|ft|foot|feet|international foot|", kFoot},
      {"|us survey foot|us_survey_foot|us-ft|ftus|foot_us|", kSurveyFoot}};
  for (const auto& [names, metres] : kUnits)
    if (names.find('|' + lower(name) + '|') != names.npos) return metres;
  return std::nullopt;
}

// Looks for the band's own unit first, then for that of a vertical reference system, then for the plan's: surveys in
// feet have heights in feet.
HeightUnit height_unit(GDALDatasetH dataset, GDALRasterBandH band, const Placement& at) {
  if (const std::string unit = line_of(GDALGetRasterUnitType(band)); !unit.empty()) {
    const auto metres = metres_of(unit);
    return {unit, metres.value_or(1), metres ? "the band" : "the band, a unit that is not known: taken for metres"};
  }
  const OGRSpatialReferenceH reference = GDALGetSpatialRef(dataset);
  if (reference && OSRIsCompound(reference)) {
    char* unit = nullptr;
    const double metres = OSRGetTargetLinearUnits(reference, "COMPD_CS|VERT_CS", &unit);
    if (metres > 0 && std::isfinite(metres) && unit) return {unit, metres, "its vertical reference system"};
  }
  if (!at.degrees && at.metres != 1)
    return {at.unit, at.metres, "its plan: the file does not say, so heights are taken to be as the plan"};
  return {};
}

// Returns the kind of the file's coordinates, and the length of a unit of each in metres.
scene::Coordinates coordinates_of(GDALDatasetH dataset, const HeightUnit& heights, const Placement& at,
                                  const glm::dvec2& shown) {
  scene::Coordinates out;
  if (!at.georeferenced) return out;
  out.space = at.degrees ? scene::Space::kGeographic : scene::Space::kProjected;
  out.shown = out.lengths = {shown, heights.metres};
  out.unit = at.unit == "metres" || at.unit.empty() ? "m" : at.unit;
  out.height_unit = heights.metres == 1 ? "m" : heights.name;
  if (const OGRSpatialReferenceH reference = GDALGetSpatialRef(dataset)) {
    out.reference = line_of(OSRGetName(reference));
    const std::string authority = line_of(OSRGetAuthorityName(reference, nullptr)),
                      code = line_of(OSRGetAuthorityCode(reference, nullptr));
    if (!authority.empty() && !code.empty()) out.reference = authority + ":" + code + " " + out.reference;
  }
  out.reference = to_utf8(out.reference.substr(0, scene::kMaxReference));
  out.unit = to_utf8(out.unit.substr(0, scene::kMaxUnit));
  out.height_unit = to_utf8(out.height_unit.substr(0, scene::kMaxUnit));
  return out;
}

// Takes the texture's colours at the raster's samples: by coordinates if both files have them, else stretched over the
// raster.
void drape(const std::string& path, const Placement& at, int full_width, int full_height, ElevationRaster& raster) {
  auto opened = open_with_gdal(gdal_place_of(path), path, "an image", kPictureDrivers);
  const GDALDatasetH image = opened.get();
  const int bands = GDALGetRasterCount(image), w = GDALGetRasterXSize(image), h = GDALGetRasterYSize(image);
  if (bands < 1 || w < 1 || h < 1 || w > kMaxSide || h > kMaxSide)
    refuse("{}: {} bands of {} x {} pixels, limit {}", path, bands, w, h, kMaxSide);
  // No finer than the raster can show: at most twice its samples on each axis.
  const int tw = std::min(w, 2 * raster.width), th = std::min(h, 2 * raster.height);
  std::vector<uint8_t> texels(size_t(3) * size_t(tw) * size_t(th));
  for (int c = 0; c < 3; ++c) {
    const GDALRasterBandH band = GDALGetRasterBand(image, std::min(c, bands - 1) + 1);
    if (GDALGetRasterDataType(band) != GDT_Byte)
      refuse("{}: has {} channels, only 8-bit ones can be draped", path,
             GDALGetDataTypeName(GDALGetRasterDataType(band)));
    if (GDALRasterIO(band, GF_Read, 0, 0, w, h, texels.data() + c, tw, th, GDT_Byte, 3, 3 * tw) != CE_None)
      refuse("{}: cannot be read: {}", path, gdal_complaint());
  }
  const Placement of = placement_of(image);
  const bool by_place = of.georeferenced && at.georeferenced && of.degrees == at.degrees;
  const bool upside_down = (of.transform[5] > 0) != (at.transform[5] > 0);
  double inverse[6];
  if (by_place && !GDALInvGeoTransform(const_cast<double*>(of.transform), inverse))
    refuse("{}: its place has no inverse", path);
  raster.colours.resize(raster.heights.size());
  for (int y = 0; y < raster.height; ++y)
    for (int x = 0; x < raster.width; ++x) {
      const double column = x * raster.step + 0.5, row = y * raster.step + 0.5;
      double fx = column / full_width, fy = row / full_height;
      if (upside_down) fy = 1 - fy;
      if (by_place) {
        const glm::dvec2 p = at.at(column, row) * (at.metres / of.metres);
        fx = (inverse[0] + p.x * inverse[1] + p.y * inverse[2]) / w;
        fy = (inverse[3] + p.x * inverse[4] + p.y * inverse[5]) / h;
      }
      const auto i = size_t(within(int(fx * tw), 0, tw - 1)), j = size_t(within(int(fy * th), 0, th - 1));
      const uint8_t* texel = &texels[3 * (j * size_t(tw) + i)];
      const bool inside = fx >= 0 && fx < 1 && fy >= 0 && fy < 1;
      raster.colours[size_t(y) * size_t(raster.width) + size_t(x)] =
          inside ? pack_rgb(texel[0], texel[1], texel[2]) : kNeutralAlbedo;
    }
}

// Refuses files that are not elevations.
void refuse_picture(GDALDatasetH dataset, const std::string& path) {
  if (const int bands = GDALGetRasterCount(dataset); bands != 1)
    refuse("{}: has {} bands: a picture, not an elevation raster, which has one", path, bands);
  const GDALRasterBandH band = GDALGetRasterBand(dataset, 1);
  if (GDALDataTypeIsComplex(GDALGetRasterDataType(band))) refuse("{}: has complex samples, not heights", path);
  if (GDALGetRasterDataType(band) != GDT_Byte) return;
  if (GDALGetRasterColorTable(band)) refuse("{}: has a palette: a picture, not an elevation raster", path);
  if (placement_of(dataset).georeferenced) return;
  refuse(
      "{}: has samples of 8 bits and no place on earth: a picture, not an elevation raster; "
      "--texture drapes it over one",
      path);
}

// Reads every step-th sample of every step-th row, in metres.
void read_heights(GDALRasterBandH band, const std::string& path, double metres, ElevationRaster& out) {
  const int w = GDALGetRasterBandXSize(band), h = GDALGetRasterBandYSize(band);
  int has_none = 0, has_scale = 0, has_offset = 0;
  const double none = GDALGetRasterNoDataValue(band, &has_none);
  const double scale = GDALGetRasterScale(band, &has_scale), offset = GDALGetRasterOffset(band, &has_offset);
  // Only a mask of the whole data set is read: no-data values are compared below, and a mask of all samples is no news.
  const bool masked = (GDALGetMaskFlags(band) & GMF_PER_DATASET) != 0;
  const GDALRasterBandH mask = GDALGetMaskBand(band);
  std::vector<float> row(size_t(w), 0.0f);
  std::vector<uint8_t> shown(size_t(w), 255);
  out.heights.reserve(size_t(out.width) * size_t(out.height));
  for (int y = 0; y < out.height; ++y) {
    if (GDALRasterIO(band, GF_Read, 0, y * out.step, w, 1, row.data(), w, 1, GDT_Float32, 0, 0) != CE_None ||
        (masked && GDALRasterIO(mask, GF_Read, 0, y * out.step, w, 1, shown.data(), w, 1, GDT_Byte, 0, 0) != CE_None))
      refuse("{}: row {} of {} cannot be read: {}", path, y * out.step, h, gdal_complaint());
    for (int x = 0; x < out.width; ++x) {
      double v = row[size_t(x) * size_t(out.step)];
      // -32768 and -9999 are the usual values of void samples, declared or not.
      const bool no_data = shown[size_t(x) * size_t(out.step)] == 0 || !std::isfinite(v) ||
                           (has_none && v == float(none)) || v == -32768 || v == -9999 || std::abs(v) > 1e9;
      if (has_scale) v *= scale;
      if (has_offset) v += offset;
      out.heights.push_back(no_data ? std::numeric_limits<float>::quiet_NaN() : float(v * metres));
    }
  }
}

ElevationRaster elevation_of(ImportFiles& files, const std::string& path, const ElevationOptions& options) {
  if (files.all().empty()) refuse("{}: no file arrived", path);
  prepare_gdal(files);
  auto opened = open_with_gdal(gdal_place_of(path), path, "an elevation raster", kElevationDrivers);
  const GDALDatasetH dataset = opened.get();
  const int w = GDALGetRasterXSize(dataset), h = GDALGetRasterYSize(dataset);
  refuse_picture(dataset, path);
  if (w < 2 || h < 2 || w > kMaxSide || h > kMaxSide)
    refuse("{}: a raster of {} x {} samples, limits 2 and {}", path, w, h, kMaxSide);
  const GDALRasterBandH band = GDALGetRasterBand(dataset, 1);
  const Placement at = placement_of(dataset);
  const HeightUnit unit = height_unit(dataset, band, at);

  ElevationRaster out;
  while (int64_t{(w + out.step - 1) / out.step} * ((h + out.step - 1) / out.step) > options.most_samples) ++out.step;
  out.width = (w + out.step - 1) / out.step;
  out.height = (h + out.step - 1) / out.step;
  read_heights(band, path, unit.metres, out);
  glm::dvec2 metres(at.metres);  // length of a unit of x and y, m
  if (at.degrees) {
    const double latitude = at.at(w / 2.0, h / 2.0).y * kPi / 180;
    metres = {111'320 * std::max(std::cos(latitude), 0.01), 110'574};
  }
  out.georeferenced = at.georeferenced;
  // A sample stands in the middle of its pixel.
  out.first = at.at(0.5, 0.5) * metres;
  out.along_row = (at.at(1, 0) - at.at(0, 0)) * metres * double(out.step);
  out.along_column = (at.at(0, 1) - at.at(0, 0)) * metres * double(out.step);
  out.coordinates = coordinates_of(dataset, unit, at, metres);
  if (at.georeferenced && !at.degrees && !at.reference)
    out.notes.push_back(path +
                        ": does not say in what system its coordinates are; they and the heights are taken for "
                        "metres");
  if (!unit.from.empty() && unit.name != "m")
    out.notes.push_back(
        fmt::format("{}: heights are in {} ({}), {:.6g} m each", path, unit.name, unit.from, unit.metres));
  if (!options.texture.empty()) drape(options.texture, at, w, h, out);
  return out;
}

RasterFacts facts_of(ImportFiles& files, const std::string& path) {
  const ElevationRaster raster = elevation_of(files, path, {});
  auto opened = open_with_gdal(gdal_place_of(path), path, "an elevation raster", kElevationDrivers);
  const GDALDatasetH dataset = opened.get();
  RasterFacts out;
  out.format = GDALGetDriverLongName(GDALGetDatasetDriver(dataset));
  out.type = GDALGetDataTypeName(GDALGetRasterDataType(GDALGetRasterBand(dataset, 1)));
  out.width = GDALGetRasterXSize(dataset), out.height = GDALGetRasterYSize(dataset);
  out.step = raster.step;
  const Placement at = placement_of(dataset);
  out.reference = raster.coordinates.reference;
  out.unit = at.unit.empty() && at.georeferenced ? "units" : at.unit;
  out.height_unit = raster.coordinates.height_unit;
  out.height_m = raster.coordinates.lengths.z;
  glm::dvec2 lo(HUGE_VAL), hi(-HUGE_VAL);
  for (const int corner : {0, 1, 2, 3}) {
    const glm::dvec2 p = at.at(corner % 2 * out.width, corner / 2 * out.height);
    lo = glm::min(lo, p), hi = glm::max(hi, p);
  }
  out.west = lo.x, out.south = lo.y, out.east = hi.x, out.north = hi.y;
  out.sample_x = glm::length(at.at(1, 0) - at.at(0, 0)), out.sample_y = glm::length(at.at(0, 1) - at.at(0, 0));
  out.sample_x_m = glm::length(raster.along_row) / raster.step;
  out.sample_y_m = glm::length(raster.along_column) / raster.step;
  out.lo = HUGE_VAL, out.hi = -HUGE_VAL;
  for (const float z : raster.heights)
    if (std::isfinite(z))
      out.lo = std::min(out.lo, double(z)), out.hi = std::max(out.hi, double(z));
    else
      ++out.without_data;
  if (out.lo > out.hi) refuse("{}: none of its samples has data", path);
  return out;
}

}  // namespace

Result<ElevationRaster> read_elevation(ImportFiles& files, const std::string& path, const ElevationOptions& options) {
  return or_error([&] { return elevation_of(files, path, options); });
}

Result<RasterFacts> read_raster_facts(ImportFiles& files, const std::string& path) {
  return or_error([&] { return facts_of(files, path); });
}

}  // namespace telesplat::data
