// Rasters as surveys give them: their units, turned grids, mosaics, and files beside them.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "services/data/mesh/reader.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

// Three samples a row, two rows, the lower left one without data.
const std::string kGrid =
    "ncols 3\nnrows 2\nxllcorner 500000\nyllcorner 4000000\ncellsize 10\nNODATA_value -9999\n"
    "100 200 300\n-9999 150 250\n";

// A VRT file over kGrid with these parts.
std::string vrt(const std::string& transform, const std::string& system = "", const std::string& of_band = "",
                const std::string& source = "grid.asc") {
  return "<!-- made by hand --><VRTDataset rasterXSize=\"3\" rasterYSize=\"2\">" +
         (system.empty() ? "" : "<SRS>" + system + "</SRS>") +
         (transform.empty() ? "" : "<GeoTransform>" + transform + "</GeoTransform>") +
         "<VRTRasterBand dataType=\"Float32\" band=\"1\"><NoDataValue>-9999</NoDataValue>" + of_band +
         "<SimpleSource><SourceFilename relativeToVRT=\"1\">" + source +
         "</SourceFilename><SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>";
}

class Rasters : public testing::Test {
 protected:
  void SetUp() override { folder.write("grid.asc", kGrid); }
  Result<Mesh> read(const std::string& name, const std::string& content) {
    return read_mesh(folder.write(name, content), nullptr);
  }
  const TempFolder folder;
};

void expect_note(const Mesh& mesh, const char* part) {
  for (const std::string& note : mesh.notes)
    if (note.find(part) != note.npos) return;
  FAIL() << part << " stands in none of " << mesh.notes.size() << " notes";
}

TEST_F(Rasters, SamplesStandInTheMiddlesOfTheirPixels) {
  const auto mesh = read("a.vrt", vrt("500000, 10, 0, 4000020, 0, -10", "EPSG:32632"));
  ASSERT_TRUE(mesh) << mesh.error().text;
  EXPECT_EQ(mesh->positions[0], glm::dvec3(500005, 4000015, 100));
  EXPECT_EQ(mesh->positions[4], glm::dvec3(500025, 4000005, 250));
  EXPECT_EQ(mesh->coordinates.reference, "EPSG:32632 WGS 84 / UTM zone 32N");
  EXPECT_TRUE(mesh->notes.empty());
}

TEST_F(Rasters, HeightsInFeetAreLengthsInMetres) {
  const std::string utm = "500000, 10, 0, 4000020, 0, -10";
  for (const auto& [unit, metres] : {std::pair{"ft", 0.3048}, {"US survey foot", 1200.0 / 3937}, {"metre", 1.0}}) {
    const auto mesh = read("a.vrt", vrt(utm, "EPSG:32632", fmt::format("<UnitType>{}</UnitType>", unit)));
    ASSERT_TRUE(mesh) << mesh.error().text;
    EXPECT_NEAR(mesh->positions[0].z, 100 * metres, 1e-4) << unit;
    EXPECT_NEAR(mesh->positions[0].z / mesh->coordinates.shown.z, 100, 1e-4) << unit;  // shown in the file's unit
  }
  // A vertical reference system in feet, and a plan in feet without a unit of heights.
  const auto compound = read("b.vrt", vrt(utm, "EPSG:32618+6360"));
  ASSERT_TRUE(compound) << compound.error().text;
  EXPECT_NEAR(compound->positions[0].z, 100 * 1200.0 / 3937, 1e-4);
  expect_note(*compound, "its vertical reference system");
  const auto plan = read("c.vrt", vrt("1640000, 32.8, 0, 1735000, 0, -32.8", "EPSG:2231"));
  ASSERT_TRUE(plan) << plan.error().text;
  EXPECT_NEAR(plan->positions[0].z, 100 * 1200.0 / 3937, 1e-4);
  EXPECT_NEAR(plan->positions[1].x - plan->positions[0].x, 32.8 * 1200 / 3937, 1e-6);
  expect_note(*plan, "heights are taken to be as the plan");
  // Feet in the plan, metres upwards.
  const auto mixed = read("d.vrt", vrt("1640000, 32.8, 0, 1735000, 0, -32.8", "EPSG:2231", "<UnitType>m</UnitType>"));
  ASSERT_TRUE(mixed) << mixed.error().text;
  EXPECT_EQ(mixed->positions[0].z, 100);
}

TEST_F(Rasters, AreTurnedAndMirroredAsTheySay) {
  const auto turned = read("a.vrt", vrt("500000, 8, 6, 4000000, 6, -8", "EPSG:32632"));
  ASSERT_TRUE(turned) << turned.error().text;
  EXPECT_EQ(turned->positions[0], glm::dvec3(500007, 3999999, 100));
  EXPECT_EQ(turned->positions[1], glm::dvec3(500015, 4000005, 200));
  const auto south_up = read("b.vrt", vrt("500000, 10, 0, 4000000, 0, 10", "EPSG:32632"));
  ASSERT_TRUE(south_up) << south_up.error().text;
  EXPECT_EQ(south_up->positions[0], glm::dvec3(500005, 4000005, 100)) << "its first row lies in the south";
  for (const auto& mesh : {*turned, *south_up}) {
    ASSERT_EQ(mesh.indices.size(), 9u);
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
      const auto p = [&](size_t k) { return mesh.positions[mesh.indices[i + k]]; };
      EXPECT_GT(glm::cross(p(1) - p(0), p(2) - p(0)).z, 0) << "seen from above";
    }
  }
}

TEST_F(Rasters, CoordinatesWithoutASystemAreLengths) {
  const auto mesh = read_mesh(folder / "grid.asc", nullptr);
  ASSERT_TRUE(mesh) << mesh.error().text;
  EXPECT_EQ(mesh->positions[0], glm::dvec3(500005, 4000015, 100));
  expect_note(*mesh, "they and the heights are taken for metres");
  // A file beside it with a reference system adds to that.
  folder.write("grid.prj",
               "PROJCS[\"WGS_1984_UTM_Zone_32N\",GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\","
               "6378137,298.257223563]],PRIMEM[\"Greenwich\",0],UNIT[\"Degree\",0.0174532925199433]],"
               "PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"False_Easting\",500000],"
               "PARAMETER[\"False_Northing\",0],PARAMETER[\"Central_Meridian\",9],PARAMETER[\"Scale_Factor\",0.9996],"
               "PARAMETER[\"Latitude_Of_Origin\",0],UNIT[\"Foot_US\",0.3048006096012192]]");
  const auto placed = read_mesh(folder / "grid.asc", nullptr);
  ASSERT_TRUE(placed) << placed.error().text;
  EXPECT_NEAR(placed->positions[0].x, 500005 * 1200.0 / 3937, 1e-3);
  EXPECT_NE(placed->coordinates.reference.find("UTM"), std::string::npos) << placed->coordinates.reference;
}

// A PNG of 16 bits of grey, stored without compression in zlib's format.
std::string png(const std::vector<uint16_t>& grey, uint32_t width, uint32_t height) {
  const auto chunk = [](const std::string& type, const std::string& data) {
    const std::string body = type + data;
    return raw(uint32_t(data.size()), true) + body +
           raw(uint32_t(crc32(0, reinterpret_cast<const Bytef*>(body.data()), uInt(body.size()))), true);
  };
  std::string rows;
  for (uint32_t y = 0; y < height; ++y) {
    rows += '\0';
    for (uint32_t x = 0; x < width; ++x) rows += raw(grey[y * width + x], true);
  }
  uLongf bytes = compressBound(uLong(rows.size()));
  std::string packed(bytes, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &bytes, reinterpret_cast<const Bytef*>(rows.data()),
           uLong(rows.size()));
  packed.resize(bytes);
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", raw(width, true) + raw(height, true) + std::string("\x10\0\0\0\0", 5)) +
         chunk("IDAT", packed) + chunk("IEND", "");
}

TEST_F(Rasters, AWorldFilePlacesAPicture) {
  folder.write("dem.pgw", "10\n0\n0\n-10\n500005\n4000015\n");
  const auto mesh = read("dem.png", png({100, 200, 300, 120, 150, 250}, 3, 2));
  ASSERT_TRUE(mesh) << mesh.error().text;
  EXPECT_EQ(mesh->positions[0], glm::dvec3(500005, 4000015, 100));
  EXPECT_EQ(mesh->positions[5], glm::dvec3(500025, 4000005, 250));
}

TEST_F(Rasters, SamplesThatAMaskHidesHaveNoData) {
  folder.write("mask.asc",
               "ncols 3\nnrows 2\nxllcorner 500000\nyllcorner 4000000\ncellsize 10\n255 255 0\n255 255 255\n");
  std::string masked = vrt("500000, 10, 0, 4000020, 0, -10", "EPSG:32632");
  masked.insert(masked.find("</VRTDataset>"),
                "<MaskBand><VRTRasterBand dataType=\"Byte\"><SimpleSource><SourceFilename relativeToVRT=\"1\">mask.asc"
                "</SourceFilename><SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></MaskBand>");
  masked.replace(masked.find("<NoDataValue>-9999</NoDataValue>"), 32, "");
  const auto mesh = read("a.vrt", masked);
  ASSERT_TRUE(mesh) << mesh.error().text;
  EXPECT_EQ(mesh->positions.size(), 4u) << "one is masked, one has no data";
}

TEST_F(Rasters, AnXyzFileIsAGrid) {
  const auto mesh = read("a.xyz", "500005 4000015 1\n500015 4000015 2\n500005 4000005 3\n500015 4000005 4\n");
  ASSERT_TRUE(mesh) << mesh.error().text;
  EXPECT_EQ(mesh->positions.size(), 4u);
  EXPECT_EQ(mesh->positions[0], glm::dvec3(500005, 4000015, 1));
  EXPECT_EQ(mesh->positions[3], glm::dvec3(500015, 4000005, 4));
}

// GDAL opens no file itself: it sees only files that were sent to it.
TEST_F(Rasters, AMosaicReadsWhatItNamesAndNothingElse) {
  const auto absent = read("a.vrt", vrt("", "", "", "missing.asc"));
  ASSERT_FALSE(absent);
  EXPECT_NE(absent.error().text.find("missing.asc"), std::string::npos) << absent.error().text;
  EXPECT_EQ(absent.error().text.find("vsimem"), std::string::npos) << absent.error().text;
  const auto files = companion_files(vrt(""), "raster", folder / "a.vrt");
  EXPECT_NE(std::find(files.begin(), files.end(), folder / "grid.asc"), files.end());
}

}  // namespace
}  // namespace telesplat::data::test
