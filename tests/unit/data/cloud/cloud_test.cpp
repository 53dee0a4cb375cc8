// Clouds: their formats, and the squares that stand for their points.
#include <glm/geometric.hpp>
#include <random>

#include "services/data/cloud/readers.h"
#include "services/data/cloud/reference.h"
#include "services/data/mesh/placing/placement.h"
#include "tests/support/files/data_files.h"
#include "tests/support/files/las_file.h"
#include "tests/unit/data/cloud/read_cloud.h"

namespace telesplat::data::test {
namespace {

using namespace std::string_literals;

TEST(RealClouds, LasOfFormat7KeepsPlacesColoursAndClasses) {
  REAL_FILE(path, "autzen_trim_7.las");
  const Mesh mesh = read(path, "classification");
  EXPECT_EQ(mesh.format, "LAS 1.4 points (format 7)");
  ASSERT_EQ(points(mesh), 110000u);
  expect_near(point(mesh, 0), {637177.98, 849393.95, 411.19}, 1e-6);
  expect_near(point(mesh, 109999), {636037.88, 849336.94, 423.20}, 1e-6);
  geometry::DBox box;
  for (size_t i = 0; i < points(mesh); ++i) box.extend(point(mesh, i));
  expect_near(box.lo, {636001.76, 848935.20, 406.26}, 1e-6);
  expect_near(box.hi, {637179.22, 849497.90, 520.51}, 1e-6);
  EXPECT_EQ(mesh.colours[0], pack_rgb(84, 102, 93));
  EXPECT_EQ(mesh.colours[4 * 109999 + 3], pack_rgb(64, 74, 70));
  EXPECT_EQ(std::count(mesh.scalars.begin(), mesh.scalars.end(), 2.0f), 4 * 26107);
  EXPECT_EQ(std::count(mesh.scalars.begin(), mesh.scalars.end(), 1.0f), 4 * 83893);
  EXPECT_EQ(mesh.coordinates.unit, "foot");
  EXPECT_DOUBLE_EQ(mesh.coordinates.lengths.z, 0.3048);
  EXPECT_EQ(guess_up(mesh).axis, "z");
}

TEST(RealClouds, ExtraBytesAreArrays) {
  REAL_FILE(path, "extrabytes.las");
  const Mesh mesh = read(path, "Colors[1]");
  ASSERT_EQ(points(mesh), 1065u);
  EXPECT_EQ(mesh.scalars[0], 77);
  EXPECT_EQ(array(mesh, "Intensity").spans[0].hi, array(mesh, "intensity").spans[0].hi);
  EXPECT_EQ(mesh.colours[0], pack_rgb(68, 77, 88));
}

TEST(RealClouds, DegreesBecomeMetres) {
  REAL_FILE(path, "epsg_4326.las");
  const Mesh mesh = read(path);
  EXPECT_EQ(mesh.coordinates.space, scene::Space::kGeographic);
  EXPECT_EQ(mesh.coordinates.reference, "EPSG:4326 WGS 84");
  expect_near(point(mesh, 0), {-94.6639387, 31.0367341, 47.8700002}, 1e-9);
  EXPECT_NEAR(mesh.coordinates.lengths.x, 111320 * std::cos(31.042 * 3.14159265 / 180), 1);
}

TEST(RealClouds, PtxAndPcdHoldTheSamePoints) {
  REAL_FILE(ptx_path, "1.2-with-color.ptx");
  REAL_FILE(pcd_path, "autzen-utm.pcd");
  const Mesh ptx = read(ptx_path), pcd = read(pcd_path, "Intensity");
  ASSERT_EQ(points(ptx), 1065u);
  ASSERT_EQ(points(pcd), 1065u);
  expect_near(point(ptx, 0), {637012.24, 849028.31, 431.66}, 1e-6);
  expect_near(point(pcd, 0), {494428.61, 4877455.58, 131.57}, 0.01);
  EXPECT_EQ(ptx.colours[0], pack_rgb(68, 77, 88));
  EXPECT_EQ(pcd.colours[0], pack_rgb(68, 77, 88));
  EXPECT_EQ(pcd.scalars[0], 143);
  EXPECT_EQ(guess_up(ptx).axis, "z");
}

// Places on a plane through (500000, 4000000, 100) that is turned about all axes.
struct Plane {
  glm::dvec3 u = glm::normalize(glm::dvec3(2, 1, 0.5)), n = glm::normalize(glm::cross(u, glm::dvec3(-1, 3, 0))),
             v = glm::cross(n, u);
  glm::dvec3 at(double a, double b) const { return glm::dvec3(500000.123, 4000000.456, 100.789) + a * u + b * v; }
};

TEST(Squares, CloseARegularPlaneAndKeepMillimetres) {
  const Plane plane;
  Cloud cloud;
  cloud.points.format = "made points", cloud.z_up = true;
  constexpr int kSide = 60;
  constexpr double kStep = 0.05;
  for (int i = 0; i < kSide * kSide; ++i)
    cloud.points.positions.push_back(plane.at(kStep * (i % kSide), kStep * (i / kSide)));
  const std::vector<glm::dvec3> given = cloud.points.positions;
  const auto made = SquareCloud::make(std::move(cloud), "made");
  ASSERT_TRUE(made.ok()) << made.error().text;
  const Mesh mesh = (*made)->mesh();
  double area = 0;
  for (size_t i = 0; i < given.size(); ++i) {
    expect_near(point(mesh, i), given[i], 1e-6);
    EXPECT_NEAR(glm::dot(glm::dvec3(mesh.normals[4 * i]), plane.n), 1, 1e-4);
    area += 4 * double((*made)->half(i)) * double((*made)->half(i));
  }
  EXPECT_LT(area, 3 * (kSide * kStep) * (kSide * kStep)) << "squares overlap more than they must";
  std::mt19937 random(5);
  std::uniform_real_distribution<double> inside(kStep, kStep * (kSide - 2));
  for (int n = 0; n < 2000; ++n) {
    const glm::dvec3 at = plane.at(inside(random), inside(random));
    bool hit = false;
    for (size_t i = 0; i < given.size() && !hit; ++i) {
      const glm::dvec3 way = at - given[i], x = mesh.positions[4 * i + 1] - mesh.positions[4 * i],
                       y = mesh.positions[4 * i + 3] - mesh.positions[4 * i];
      hit = std::abs(glm::dot(way, x)) <= glm::dot(x, x) / 2 && std::abs(glm::dot(way, y)) <= glm::dot(y, y) / 2;
    }
    EXPECT_TRUE(hit) << "a hole";
  }
}

TEST(Squares, StraysWiresAndDoubledPointsStaySmall) {
  Cloud cloud;
  cloud.points.format = "made points", cloud.z_up = true;
  auto& p = cloud.points.positions;
  for (int i = 0; i < 400; ++i) p.emplace_back(i % 20, i / 20, 0);
  p.emplace_back(10, 10, 50);                                    // a bird
  for (int i = 0; i < 30; ++i) p.emplace_back(0.1 * i, 40, 20);  // a wire
  for (int i = 0; i < 12; ++i) p.emplace_back(5, -30, 0);        // one place
  const auto made = SquareCloud::make(std::move(cloud), "made");
  ASSERT_TRUE(made.ok()) << made.error().text;
  EXPECT_LT((*made)->half(400), 3);
  EXPECT_LT((*made)->half(416), 0.15);
  EXPECT_GT((*made)->half(435), 0);
  EXPECT_LT((*made)->half(435), 3);
}

TEST(Squares, LookTowardsTheirScanner) {
  std::string file =
      "ply\nformat ascii 1.0\nelement vertex 200\nproperty float x\nproperty float y\nproperty float z\n"
      "end_header\n";
  for (int i = 0; i < 200; ++i) file += fmt::format("{} {} {}\n", i % 20, 0, i / 20);
  // A wall, seen from y = -5: scanner's place and pose turn (x, y, z) to (x, z - 5, -y).
  std::string ptx = "20\n10\n0 -5 0\n1 0 0\n0 0 -1\n0 1 0\n1 0 0 0\n0 0 -1 0\n0 1 0 0\n0 -5 0 1\n";
  for (int i = 0; i < 200; ++i)
    ptx += i == 7 ? "0 0 0 0.5\n"s : fmt::format("{} {} {} 0.{}\n", i % 20, -(i / 20), 5, i % 9);
  const Mesh wall = read_text("wall.ptx", ptx);
  ASSERT_EQ(points(wall), 199u);
  expect_near(point(wall, 1), {1, 0, 0}, 1e-6);
  for (const glm::vec3& n : wall.normals) EXPECT_NEAR(n.y, -1, 1e-3);
  EXPECT_NE(remarks(wall).find("1 points are left out: the scanner measured none"), std::string::npos) << remarks(wall);
  EXPECT_EQ(points(read_text("wall.ply", file)), 200u);
}

TEST(Las, LeavesWithheldPointsOutAndJudgesColoursByAllOfThem) {
  std::vector<LasPoint> cloud;
  for (int i = 0; i < 20; ++i)
    cloud.push_back({.x = 100 * (i % 5), .y = 100 * (i / 5), .classes = uint8_t(i == 3 ? 0x82 : 2), .red = 200});
  const Mesh bytes = read_text("bytes", las_file(cloud));
  EXPECT_EQ(points(bytes), 19u);
  EXPECT_NE(remarks(bytes).find("1 points are left out: the file marks them as withheld"), std::string::npos);
  EXPECT_EQ(bytes.colours[0], pack_rgb(200, 0, 0));
  EXPECT_EQ(array(bytes, "classification").spans[0].hi, 2);
  cloud.back().blue = 0xffff;
  EXPECT_EQ(read_text("words", las_file(cloud)).colours[0], pack_rgb(1, 0, 0));
  for (LasPoint& p : cloud) p.red = p.blue = 0, p.intensity = uint16_t(p.x);
  const Mesh grey = read_text("grey", las_file(cloud));
  EXPECT_EQ(grey.colours[0], pack_rgb(40, 40, 40));
  EXPECT_NE(remarks(grey).find("its intensity is shown in grey"), std::string::npos) << remarks(grey);
}

TEST(Las, ReadsEveryNthPointOfMore) {
  std::vector<LasPoint> cloud;
  for (int i = 0; i < 1000; ++i) cloud.push_back({.x = 100 * (i % 30), .y = 100 * (i / 30)});
  const auto few = read_las(las_file(cloud), "few", nullptr, "", 100);
  ASSERT_TRUE(few.ok()) << few.error().text;
  EXPECT_EQ((*few)->vertices(), 400u);
}

TEST(References, TellUnitsAndKind) {
  const auto feet = reference_of_wkt(
      R"(COMPD_CS["a",PROJCS["Ohio",GEOGCS["NAD83",UNIT["degree",0.0174]],UNIT["US survey foot",0.304800609601219,)"
      R"(AUTHORITY["EPSG","9003"]],AUTHORITY["EPSG","3735"]],VERT_CS["NAVD88",UNIT["metre",1]]])");
  ASSERT_TRUE(feet);
  EXPECT_EQ(feet->coordinates.reference, "EPSG:3735 Ohio");
  EXPECT_EQ(feet->coordinates.unit, "US survey foot");
  EXPECT_EQ(feet->coordinates.height_unit, "m");
  EXPECT_NEAR(feet->coordinates.shown.x, 0.304800609601219, 1e-15);
  EXPECT_EQ(feet->coordinates.shown.z, 1);
  const auto zone = reference_of_wkt(R"(PROJCRS["UTM 32N",BASEGEOGCRS["WGS 84",ANGLEUNIT["degree",0.0174]],)"
                                     R"(CS[Cartesian,2],AXIS["E",east,LENGTHUNIT["metre",1]],ID["EPSG",32632]])");
  ASSERT_TRUE(zone);
  EXPECT_EQ(zone->coordinates.space, scene::Space::kProjected);
  EXPECT_EQ(zone->coordinates.reference, "EPSG:32632 UTM 32N");
  const uint16_t keys[] = {1, 1, 0, 3, 1024, 0, 1, 1, 3072, 0, 1, 2276, 3076, 0, 1, 9003};
  const auto texas = reference_of_keys(keys, "");
  ASSERT_TRUE(texas);
  EXPECT_EQ(texas->coordinates.reference, "EPSG:2276");
  EXPECT_NEAR(texas->coordinates.shown.y, 1200.0 / 3937, 1e-12);
  EXPECT_EQ(texas->coordinates.height_unit, "US survey foot");
  EXPECT_FALSE(reference_of_wkt("LOCAL_CS[\"mine\"]"));
}

const std::string kPcd =
    "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z _ rgb label\nSIZE 4 4 4 1 4 2\nTYPE F F F U F U\n"
    "COUNT 1 1 1 4 1 2\nWIDTH 3\nHEIGHT 1\nPOINTS 3\nDATA ";

// The points of kPcd, each by itself, or each field by itself.
std::string pcd_bytes(bool by_field) {
  std::string fields[5], out;
  for (int i = 0; i < 3; ++i) {
    const std::string point[5] = {raw(float(i)), raw(float(i % 2)), raw(0.5f) + "pads",
                                  raw(uint32_t{0x102030} + uint32_t(i)), raw(uint16_t(i)) + raw(uint16_t(i + 7))};
    for (int f = 0; f < 5; ++f) {
      if (f == 2)
        fields[f].insert(fields[f].size() / 2, point[f].substr(0, 4)), fields[f] += "pads";
      else
        fields[f] += point[f];
      out += point[f];
    }
  }
  if (!by_field) return out;
  fields[2] = raw(0.5f) + raw(0.5f) + raw(0.5f) + "padspadspads";
  return fields[0] + fields[1] + fields[2] + fields[3] + fields[4];
}

// Packs by LZF: the last of equal groups "pads" as a repetition, all else as it is.
std::string lzf(const std::string& bytes) {
  const size_t repeated = bytes.find("padspadspads") + 4;
  std::string out;
  const auto literal = [&](const std::string& text) {
    for (size_t at = 0; at < text.size(); at += 32) {
      const std::string run = text.substr(at, 32);
      out += char(run.size() - 1) + run;
    }
  };
  literal(bytes.substr(0, repeated));
  out += char((8 - 2) << 5), out += char(3);  // eight bytes from four bytes back
  literal(bytes.substr(repeated + 8));
  return out;
}

TEST(Pcd, HasOneMeaningInEachEncoding) {
  const std::string packed = lzf(pcd_bytes(true));
  const std::string files[] = {
      kPcd +
          "ascii\n0 0 0.5 1 1 1 1 1.48091464e-39 0 7\n1 1 .5 1 1 1 1 1.48091464e-39 1 8\n2 0 .5 1 1 1 1 1.48091464e-39 "
          "2 9\n",
      kPcd + "binary\n" + pcd_bytes(false),
      kPcd + "binary_compressed\n" + raw(uint32_t(packed.size())) + raw(uint32_t(pcd_bytes(true).size())) + packed};
  for (const std::string& file : files) {
    const Mesh mesh = read_text("cloud.dat", file, "label[1]");
    ASSERT_EQ(points(mesh), 3u);
    expect_near(point(mesh, 1), {1, 1, 0.5}, 1e-6);
    EXPECT_EQ(mesh.scalars[4], 8);
    EXPECT_EQ(mesh.colours[0] & 0xfffff0, 0x102030u & 0xfffff0);
    EXPECT_EQ(mesh.arrays.size(), 2u);
  }
}

struct Text {
  std::string name, content, arrays;
  uint32_t colour;  // the first point has it
  bool normals;
};

class Texts : public testing::TestWithParam<Text> {};

TEST_P(Texts, AreReadByTheirColumns) {
  const Text& text = GetParam();
  std::string names;
  const Mesh mesh = read_text(text.name, text.content);
  for (const auto& a : mesh.arrays) names += (names.empty() ? "" : ",") + a.name;
  EXPECT_EQ(names, text.arrays);
  ASSERT_EQ(points(mesh), 3u);
  EXPECT_EQ(mesh.format, "text points");
  expect_near(point(mesh, 0), {500000.123, 4000000.456, 7}, 1e-6);
  EXPECT_EQ(mesh.colours.empty() ? 0 : mesh.colours[0], text.colour);
  if (text.normals) EXPECT_EQ(mesh.normals[0], glm::vec3(0, 1, 0));
}

std::string rows(const std::string& first, const std::string& other, const char* gap = " ") {
  std::string out =
      "500000.123 4000000.456 7" + first + "\n500001 4000003 8" + other + "\r\n\n500005 4000001 9" + other + "\n";
  std::string separated;
  for (const char c : out) c == ' ' ? separated += gap : separated += c;
  return separated;
}

INSTANTIATE_TEST_SUITE_P(
    All, Texts,
    testing::Values(
        Text{"plain.xyz", rows("", ""), "", 0, false},
        Text{"counted.pts", "3\n" + rows(" -2048 10 20 30", " 2047 40 50 60"), "intensity", pack_rgb(10, 20, 30),
             false},
        Text{"intensity.pts", rows(" 5", " 9"), "intensity", pack_rgb(40, 40, 40), false},
        Text{"colours.txt", "# made by hand\n" + rows(" 10 20 30", " 40 50 60"), "", pack_rgb(10, 20, 30), false},
        Text{"normals.asc", rows(" 0 1 0", " 1 0 0"), "", 0, true},
        Text{"named.csv",
             "\"X\",\"Y\",\"Z\",\"Class\",\"Red\",\"Green\",\"Blue\"\n" + rows(" 4 1 2 3", " 5 250 8 9", ","), "Class",
             pack_rgb(1, 2, 3), false},
        Text{"compared.txt", "//X Y Z R G B Nx Ny Nz\n" + rows(" 9 8 7 0 1 0", " 9 8 7 1 0 0", ";"), "",
             pack_rgb(9, 8, 7), true}),
    [](const auto& info) { return info.param.name.substr(0, info.param.name.find('.')); });

TEST(Texts, GridsAreRasters) {
  std::string grid, cloud = rows("", "");
  for (int i = 0; i < 20; ++i) grid += fmt::format("{} {} {}\n", i % 5 * 10, i / 5 * -10, i);
  EXPECT_EQ(detect_format(grid, "a.xyz").format, "raster");
  EXPECT_EQ(detect_format(cloud + cloud, "a.xyz").format, "xyz");
  EXPECT_EQ(detect_format("ncols 3\nnrows 3\n", "a.asc").format, "raster");
  EXPECT_EQ(detect_format("Dear diary,\n1 2 3\n", "a.txt").format, "");
}

TEST(PlyPoints, KeepDoublesColoursNormalsAndArrays) {
  const Mesh mesh = read_text("points.ply",
                              "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
                              "property double z\nproperty ushort red\nproperty ushort green\nproperty ushort blue\n"
                              "property float nx\nproperty float ny\nproperty float nz\nproperty float quality\n"
                              "end_header\n500000.123 4000000.456 7 65535 0 257 0 0 2 0.5\n"
                              "500001 4000003 8 0 0 0 0 1 0 0.25\n500005 4000001 nan 0 0 0 1 0 0 1\n",
                              "quality");
  ASSERT_EQ(points(mesh), 2u);
  EXPECT_EQ(mesh.format, "PLY points (ascii)");
  expect_near(point(mesh, 0), {500000.123, 4000000.456, 7}, 1e-6);
  EXPECT_EQ(mesh.colours[0], pack_rgb(255, 0, 1));
  EXPECT_EQ(mesh.normals[0], glm::vec3(0, 0, 1));
  EXPECT_EQ(mesh.scalars[4], 0.25f);
  EXPECT_NE(remarks(mesh).find("1 of 3 points are left out"), std::string::npos) << remarks(mesh);
}

}  // namespace
}  // namespace telesplat::data::test
