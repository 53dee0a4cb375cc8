// XML files of one data set: encodings, kinds, cells.
#include <cmath>
#include <random>

#include "tests/unit/data/vtk/vtk_files.h"

namespace telesplat::data::test {
namespace {

using Mode = VtkEncoding::Mode;

void expect_two_bricks(const Mesh& mesh) {
  expect_shape(mesh, 20, 10, 2);
  ASSERT_EQ(mesh.arrays.size(), 2u);
  EXPECT_EQ(mesh.arrays[0], (scene::ArrayInfo{"heat", "", false, 1, {{0, 5.5}}}));
  EXPECT_EQ(mesh.arrays[1], (scene::ArrayInfo{"number", "", true, 1, {{0, 1}}}));
}

TEST(VtkXml, ReadsEveryEncodingAndCompressor) {
  const TempFolder folder;
  for (const Mode mode : {Mode::kBase64, Mode::kAppendedRaw, Mode::kAppendedBase64})
    for (const char* packing : {"", "ZLib", "LZ4", "LZMA"})
      for (int bits = 0; bits < 8; ++bits) {
        const VtkEncoding encoding{mode, packing, (bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0};
        SCOPED_TRACE(fmt::format("mode {}, {}, {:b}", int(mode), packing, bits));
        expect_two_bricks(mesh_or_fail(folder.write("a.vtu", vtu(bricks(2), encoding))));
      }
  expect_two_bricks(mesh_or_fail(folder.write("a.vtu", vtu(bricks(2)))));
}

TEST(VtkXml, IsToldByAnXmlParser) {
  const TempFolder folder;
  std::string text = vtu(bricks(2));
  text.replace(0, text.find("<VTKFile"), "\xef\xbb\xbf<?xml version='1.0'?>\n<!-- <VTKFile type=\"PolyData\"> -->\n");
  text.replace(text.find("type=\"UnstructuredGrid\""), 23, "version = '0.1' type = 'UnstructuredGrid'");
  text.replace(text.find("header_type=\"UInt32\""), 20, "header_type='UInt64'");
  const Mesh mesh = mesh_or_fail(folder.write("without_extension", text));
  EXPECT_EQ(mesh.format, "vtu");
  expect_two_bricks(mesh);
}

// One cell of each type: its volume is known, its surface closed.
TEST(VtkXml, VolumeCellsFaceOutwardHoweverTheyAreTurned) {
  struct Case {
    int type;
    std::vector<double> points;
    size_t triangles;
    double volume;
  };
  const Grid brick = bricks(1);
  const std::vector<double>& hexahedron = brick.points;
  std::vector<double> corners;  // in a hexahedron's order
  for (const int64_t i : brick.cells[0])
    corners.insert(corners.end(), hexahedron.begin() + 3 * i, hexahedron.begin() + 3 * i + 3);
  std::vector<double> prism[2];
  for (const int n : {5, 6})
    for (int i = 0; i < 2 * n; ++i) {
      const double angle = 2 * M_PI * (i % n) / n;
      prism[n - 5].insert(prism[n - 5].end(), {std::cos(angle), std::sin(angle), double(i / n)});
    }
  const Case cases[] = {{10, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, 4, 1 / 6.0},
                        {11, hexahedron, 12, 1},
                        {12, corners, 12, 1},
                        {13, {0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 1, 1, 1, 0, 1}, 8, 0.5},
                        {14, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1}, 6, 1 / 3.0},
                        {15, prism[0], 16, 2.5 * std::sin(2 * M_PI / 5)},
                        {16, prism[1], 20, 3 * std::sin(2 * M_PI / 6)}};
  const TempFolder folder;
  for (const Case& c : cases)
    for (const double mirror : {1.0, -1.0}) {
      SCOPED_TRACE(fmt::format("type {}, {}", c.type, mirror));
      Grid grid{c.points, {{}}, {uint8_t(c.type)}, {}};
      for (size_t i = 0; i < c.points.size() / 3; ++i)
        grid.cells[0].push_back(int64_t(i)), grid.points[3 * i] *= mirror;
      const Shape shape = shape_of(mesh_or_fail(folder.write("a.vtu", vtu(grid))));
      EXPECT_EQ(shape.triangles, c.triangles);
      EXPECT_NEAR(shape.volume, c.volume, 1e-9);
      EXPECT_TRUE(shape.closed);
    }
}

// Ten nodes; the middle nodes are a tenth off the edges' middles.
TEST(VtkXml, QuadraticCellsAreDividedAtTheirMiddles) {
  const TempFolder folder;
  Grid grid{{0,   0,   0, 1,   0,  0,   0,   1,   0,  0,   0, 1,   .5, -.1, -.1,
             .55, .55, 0, -.1, .5, -.1, -.1, -.1, .5, .55, 0, .55, 0,  .55, .55},
            {{0, 1, 2, 3, 4, 5, 6, 7, 8, 9}},
            {24},
            {}};
  const Shape shape = shape_of(mesh_or_fail(folder.write("a.vtu", vtu(grid))));
  EXPECT_EQ(shape.triangles, 16u);
  EXPECT_TRUE(shape.closed);
  EXPECT_GT(shape.volume, 1 / 6.0 + 0.05);
  grid.types = {71};  // Lagrange's, of second order: the same nodes
  EXPECT_NEAR(shape_of(mesh_or_fail(folder.write("b.vtu", vtu(grid)))).volume, shape.volume, 1e-12);
  Grid flat{{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, .5, -.2, 0, 1, .5, 0, .5, 1, 0, 0, .5, 0},
            {{0, 1, 2, 3, 4, 5, 6, 7}},
            {23},
            {}};
  const Shape quad = shape_of(mesh_or_fail(folder.write("c.vtu", vtu(flat))));
  EXPECT_EQ(quad.triangles, 6u);
  EXPECT_NEAR(quad.area, 1.1, 1e-12);
}

// Two polyhedra; faces have either orientation.
TEST(VtkXml, PolyhedraOfBothLayouts) {
  const TempFolder folder;
  Grid grid = bricks(2);
  grid.types = {42, 42};
  constexpr int kFaces[6][4] = {{0, 3, 7, 4}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}};
  std::vector<int64_t> stream, stream_ends, ids, ends, to_faces{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}, cell_ends{6, 12};
  for (const auto& cell : grid.cells) {
    stream.push_back(6);
    for (const auto& face : kFaces) {
      stream.push_back(4);
      for (const int corner : face) stream.push_back(cell[size_t(corner)]), ids.push_back(cell[size_t(corner)]);
      ends.push_back(int64_t(ids.size()));
    }
    stream_ends.push_back(int64_t(stream.size()));
  }
  VtkWriter w;
  grid.more = w.array("Int64", "Name=\"faces\"", stream) + w.array("Int64", "Name=\"faceoffsets\"", stream_ends);
  expect_two_bricks(mesh_or_fail(folder.write("streams.vtu", vtu(grid))));
  grid.more = w.array("Int64", "Name=\"face_connectivity\"", ids) + w.array("Int64", "Name=\"face_offsets\"", ends) +
              w.array("Int64", "Name=\"polyhedron_to_faces\"", to_faces) +
              w.array("Int64", "Name=\"polyhedron_offsets\"", cell_ends);
  expect_two_bricks(mesh_or_fail(folder.write("listed.vtu", vtu(grid))));
}

TEST(VtkXml, ASurfaceCellOnAVolumeCellIsShownOnceWithItsData) {
  const TempFolder folder;
  Grid grid = bricks(2);
  grid.cells.push_back({0, 6, 9, 3});  // the face at x = 0, turned inward
  grid.cells.push_back({0, 1});
  grid.types.insert(grid.types.end(), {9, 3});
  const Mesh mesh = mesh_or_fail(folder.write("a.vtu", vtu(grid)), "number");
  expect_shape(mesh, 20, 10, 2);
  EXPECT_EQ(std::count(mesh.scalars.begin(), mesh.scalars.end(), 2.0f), 2);
  ASSERT_EQ(mesh.notes.size(), 1u);
  EXPECT_NE(mesh.notes[0].find("1 points and lines"), std::string::npos) << mesh.notes[0];
}

TEST(VtkXml, GhostCellsCoverFacesAndHiddenOnesDoNot) {
  const TempFolder folder;
  VtkWriter w;
  const auto marked = [&](uint8_t mark) {
    return mesh_or_fail(folder.write(
        "a.vtu", vtu(bricks(2), {}, w.array("UInt8", "Name=\"vtkGhostType\"", std::vector<uint8_t>{0, mark}))));
  };
  EXPECT_EQ(shape_of(marked(1)).triangles, 10u) << "the face towards the ghost is within the whole";
  expect_shape(marked(32), 12, 6, 1);
  const Mesh mesh = marked(32);
  EXPECT_EQ(mesh.arrays.size(), 2u) << "marks are no array";
}

TEST(VtkXml, ColoursOfFaces) {
  const TempFolder folder;
  VtkWriter w;
  const std::string colours = w.array("UInt8", "Name=\"paint\" NumberOfComponents=\"4\"",
                                      std::vector<uint8_t>{220, 30, 30, 255, 30, 200, 30, 9});
  const Mesh mesh = mesh_or_fail(folder.write("a.vtu", vtu(bricks(2), {}, colours)));
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {
    double x = 0;
    for (size_t c = 0; c < 3; ++c) x += mesh.positions[mesh.indices[i + c]].x / 3;
    for (size_t c = 0; c < 3; ++c)
      EXPECT_EQ(mesh.colours[mesh.indices[i + c]], x < 1 ? pack_rgb(220, 30, 30) : pack_rgb(30, 200, 30));
  }
}

std::string structured(const std::string& kind, const std::string& points, const std::string& data = "") {
  return VtkWriter().file(
      kind, fmt::format("<{0} WholeExtent='1 3 0 1 2 3'><Piece Extent='1 3 0 1 2 3'>{1}{2}</Piece></{0}>", kind, data,
                        points));
}

TEST(VtkXml, StructuredAndRectilinearGrids) {
  const TempFolder folder;
  VtkWriter w;
  const auto axis = [&](std::vector<double> v) { return w.array("Float64", "", v); };
  const std::string axes = "<Coordinates>" + axis({0, 1, 2}) + axis({0, 1}) + axis({0, 1}) + "</Coordinates>";
  const std::string points = "<Points>" + w.array("Float64", "NumberOfComponents='3'", bricks(2).points) + "</Points>";
  expect_shape(mesh_or_fail(folder.write("a.vtr", structured("RectilinearGrid", axes))), 20, 10, 2);
  expect_shape(mesh_or_fail(folder.write("a.vts", structured("StructuredGrid", points))), 20, 10, 2);
  const std::string hidden =
      "<CellData>" + w.array("UInt8", "Name=\"vtkGhostType\"", std::vector<uint8_t>{32, 0}) + "</CellData>";
  expect_shape(mesh_or_fail(folder.write("b.vts", structured("StructuredGrid", points, hidden))), 12, 6, 1);
  const std::string hidden_point =
      "<PointData>" +
      w.array("UInt8", "Name=\"vtkGhostType\"", std::vector<uint8_t>{0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0}) +
      "</PointData>";
  expect_shape(mesh_or_fail(folder.write("c.vts", structured("StructuredGrid", points, hidden_point))), 12, 6, 1);
}

TEST(VtkXml, UnitsStandInAnArraysInformation) {
  const TempFolder folder;
  const std::string array =
      "<DataArray type='Float32' Name='p' format='ascii'>\n1 2\n<InformationKey name='UNITS_LABEL' "
      "location='vtkDataArray'> kPa </InformationKey></DataArray>";
  EXPECT_EQ(mesh_or_fail(folder.write("a.vtu", vtu(bricks(2), {}, array))).arrays.back().unit, "kPa");
}

// Damaged files give a reason that names the file, or a mesh; no crash, no memory for claims.
TEST(VtkXml, SurvivesCutAndChangedFiles) {
  const TempFolder folder;
  std::mt19937 random(7);
  for (const Mode mode : {Mode::kAscii, Mode::kBase64, Mode::kAppendedRaw})
    for (const char* packing : {"", "ZLib", "LZ4", "LZMA"}) {
      if (mode == Mode::kAscii && *packing) continue;
      const std::string whole = vtu(bricks(2), {mode, packing});
      const auto read = [&](const std::string& content) {
        const auto mesh = read_mesh(folder.write("a.vtu", content), nullptr);
        if (!mesh) {
          EXPECT_NE(mesh.error().text.find("a.vtu: "), std::string::npos) << mesh.error().text;
        }
        return mesh.ok();
      };
      for (size_t bytes = 1; bytes < whole.find("</Cells>"); bytes += 11) EXPECT_FALSE(read(whole.substr(0, bytes)));
      for (int n = 0; n < 150; ++n) {
        std::string changed = whole;
        for (int k = 0; k < 3; ++k) changed[random() % changed.size()] = char(random());
        read(changed);
      }
    }
}

TEST(VtkXml, RefusesWhatDoesNotFit) {
  const TempFolder folder;
  const auto says = [&](const std::string& content) {
    const auto mesh = read_mesh(folder.write("a.vtu", content), nullptr);
    return mesh ? std::string("a mesh") : mesh.error().text;
  };
  const std::string whole = vtu(bricks(1));
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string out = whole;
    return out.replace(out.find(from), from.size(), to);
  };
  EXPECT_NE(says(with("NumberOfPoints='8'", "NumberOfPoints='88888888888888'")).find("claims 88888888888888"),
            std::string::npos);
  EXPECT_NE(says(with("NumberOfPoints='8'", "NumberOfPoints='9'")).find("27 are needed"), std::string::npos);
  EXPECT_NE(says(with("0 1 3 2", "0 1 3 77")).find("point 77 of 8"), std::string::npos);
  EXPECT_NE(says(with("0 1 3 2", "0 1 3 -2")).find("negative"), std::string::npos);
  EXPECT_NE(says(with("\n8\n", "\n7\n")).find("7 points of 8"), std::string::npos);
  EXPECT_NE(says(with("\n8\n", "\n9\n")).find("ends at 9 of 8"), std::string::npos);
  VtkWriter bomb({Mode::kBase64, "ZLib"});
  std::string packed = vtu(bricks(1), {Mode::kBase64, "ZLib"});
  const size_t at = packed.find("binary\">\n  ") + 11;
  packed.replace(at, 16,
                 base64(raw(uint32_t{1}) + raw(~uint32_t{0}) + raw(uint32_t{0}) + raw(uint32_t{9})).substr(0, 16));
  EXPECT_NE(says(packed).find("claims 1 blocks of 4294967295 bytes"), std::string::npos) << says(packed);
}

// VTK's own blocks have 32768 bytes; the packed array is shorter than one, and its beginning packs well.
TEST(VtkXml, ABlockThatIsNotFullIsPackedAlone) {
  for (const char* packing : {"ZLib", "LZ4", "LZMA"}) {
    const TempFolder folder;
    const VtkEncoding encoding{.mode = VtkEncoding::Mode::kAppendedRaw, .packing = packing, .block = 32768};
    expect_shape(mesh_or_fail(folder.write("a.vtu", vtu(bricks(2), encoding))), 20, 10, 2);
  }
}

}  // namespace
}  // namespace telesplat::data::test
