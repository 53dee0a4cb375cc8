// Arrays of numbers in mesh files: listed with their ranges, read into chunks, refused if they are missing.
#include <bit>
#include <limits>
#include <set>

#include "common/scene/colouring.h"
#include "services/data/mesh/reader.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

using namespace std::string_literals;

Result<std::vector<scene::ArrayInfo>> mesh_arrays(const std::string& path) {
  auto mesh = read_mesh(path, {});
  if (!mesh) return mesh.error();
  return std::move(mesh->arrays);
}

const float kNan = std::numeric_limits<float>::quiet_NaN();

// A square of two triangles with the properties heat (float, one of them NaN) and id (uint8) of vertices, and area
// (double) of faces; positions like those of ply_of().
std::string square_ply(const std::string& encoding) {
  const bool ascii = encoding == "ascii", big = encoding == "binary_big_endian";
  std::string file = fmt::format(
      "ply\nformat {} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float "
      "heat\n"
      "property uchar id\nelement face 2\nproperty double area\nproperty list uchar int vertex_indices\n"
      "property short after\nend_header\n",
      encoding);
  const auto put = [&](auto v) { file += ascii ? fmt::format("{} ", +v) : raw(v, big); };
  const float heat[] = {-1.5f, 2.0f, kNan, 10.0f};
  for (int v = 0; v < 4; ++v) {
    put(float(v == 1 || v == 2)), put(float(v >= 2)), put(0.0f), put(heat[v]);
    put(uint8_t(v * 10));
  }
  for (int f = 0; f < 2; ++f) {
    put(0.5 + f);
    put(uint8_t{3}), put(0), put(f + 1), put(f + 2);
    put(int16_t(-f));
  }
  return file;
}

class PlyArrays : public testing::TestWithParam<std::string> {};

TEST_P(PlyArrays, OfVerticesAndFacesAreListedAndRead) {
  const std::string file = square_ply(GetParam());
  FolderCompanions none("/nonexistent/square.ply");
  const auto plain = read_ply(file, "square.ply", nullptr, none);
  ASSERT_TRUE(plain.ok()) << plain.error().text;
  EXPECT_TRUE(plain->scalars.empty());
  ASSERT_EQ(plain->arrays.size(), 4u);
  EXPECT_EQ(plain->arrays[0], (scene::ArrayInfo{"heat", "", false, 1, {{-1.5, 10}}}));
  EXPECT_EQ(plain->arrays[1], (scene::ArrayInfo{"id", "", false, 1, {{0, 30}}}));
  EXPECT_EQ(plain->arrays[2], (scene::ArrayInfo{"area", "", true, 1, {{0.5, 1.5}}}));
  EXPECT_EQ(plain->arrays[3], (scene::ArrayInfo{"after", "", true, 1, {{-1, 0}}}));

  const auto heat = read_ply(file, "square.ply", nullptr, none, "heat");
  ASSERT_TRUE(heat.ok()) << heat.error().text;
  ASSERT_EQ(heat->scalars.size(), 4u);
  EXPECT_FALSE(heat->scalars_of_faces);
  EXPECT_EQ(heat->scalars[0], -1.5f);
  EXPECT_TRUE(std::isnan(heat->scalars[2]));
  for (const auto& [name, values] : {std::pair{"area", std::vector<float>{0.5f, 1.5f}}, {"after", {0, -1}}}) {
    const auto faces = read_ply(file, "square.ply", nullptr, none, name);
    ASSERT_TRUE(faces.ok()) << faces.error().text;
    EXPECT_TRUE(faces->scalars_of_faces);
    EXPECT_EQ(faces->scalars, values) << name;
  }
  const auto unknown = read_ply(file, "square.ply", nullptr, none, "cold");
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().text, "square.ply: there is no array \"cold\"; there are: heat, id, area, after");
  for (size_t length = 0; length + 1 < file.size(); ++length) {
    const std::vector<char> cut(file.begin(), file.begin() + long(length));
    for (const char* array : {"heat", "area"})
      (void)read_ply({cut.data(), length}, "cut", nullptr, none, array).ok();  // refused or not, without a crash
  }
}

INSTANTIATE_TEST_SUITE_P(Encodings, PlyArrays, testing::Values("ascii", "binary_little_endian", "binary_big_endian"));

TEST(PlyArray, OfAFaceIsThatOfAllItsTriangles) {
  const std::string file =
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 3\nproperty list uchar int vertex_indices\nproperty float part\nend_header\n"
      "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0.5 2 0\n4 0 1 2 3 7\n2 0 1 8\n3 3 2 4 9\n";
  FolderCompanions none("/nonexistent/quad.ply");
  const auto mesh = read_ply(file, "quad.ply", nullptr, none, "part");
  ASSERT_TRUE(mesh.ok()) << mesh.error().text;
  EXPECT_EQ(mesh->scalars, (std::vector<float>{7, 7, 9}));  // the face of two corners is left out
}

// A tetrahedron in VTK's formats, with arrays: t of points (1 2 3 and not a number), v a vector of points, c of cells.
constexpr const char* kVtp = R"(<?xml version="1.0"?>
<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian"><PolyData>
<Piece NumberOfPoints="4" NumberOfVerts="1" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="2">
<PointData>
<DataArray type="Float32" Name="t" format="binary">EAAAAAAAgD8AAABAAABAQAAAwH8=</DataArray>
<DataArray type="Float64" Name="v" NumberOfComponents="3" format="ascii">3 4 0 0 0 1 0 0 2 0 0 -7</DataArray>
</PointData>
<CellData><DataArray type="Int32" Name="c" format="ascii">100 5 6</DataArray>
<DataArray type="Float64" Name="t" format="ascii">1 1 1</DataArray></CellData>
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>
<Verts><DataArray type="Int64" Name="connectivity" format="ascii">0</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">1</DataArray></Verts>
<Polys><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 0 1 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3 6</DataArray></Polys>
</Piece></PolyData></VTKFile>
)";

TEST(VtpArrays, OfPointsAndCellsAndComponents) {
  const TempFolder folder;
  const std::string path = folder.write("t.vtp", kVtp);
  const auto arrays = mesh_arrays(path);
  ASSERT_TRUE(arrays.ok()) << arrays.error().text;
  ASSERT_EQ(arrays->size(), 4u);
  EXPECT_EQ((*arrays)[0], (scene::ArrayInfo{"t", "", false, 1, {{1, 3}}}));
  EXPECT_EQ((*arrays)[1], (scene::ArrayInfo{"v", "", false, 3, {{1, 7}, {0, 3}, {0, 4}, {-7, 2}}}));
  EXPECT_EQ((*arrays)[2], (scene::ArrayInfo{"c", "", true, 1, {{5, 6}}})) << "a vertex cell is not shown";
  EXPECT_EQ((*arrays)[3].name, "t (cell)");

  const auto read = [&](const std::string& array) {
    auto mesh = read_mesh(path, nullptr, {}, array);
    EXPECT_TRUE(mesh.ok()) << (mesh ? "" : mesh.error().text);
    return mesh ? std::move(*mesh) : Mesh();
  };
  EXPECT_EQ(read("t").scalars[1], 2);
  EXPECT_TRUE(std::isnan(read("t").scalars[3]));
  EXPECT_EQ(read("v").scalars, (std::vector<float>{5, 1, 2, 7}));
  EXPECT_EQ(read("v.y").scalars, (std::vector<float>{4, 0, 0, 0}));
  EXPECT_EQ(read("v[2]").scalars, (std::vector<float>{0, 1, 2, -7}));
  const Mesh cells = read("c");  // behind the value of the vertex cell
  EXPECT_TRUE(cells.scalars_of_faces);
  EXPECT_EQ(cells.scalars, (std::vector<float>{5, 6}));
  const auto unknown = read_mesh(path, nullptr, {}, "pressure");
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().text.find("there is no array \"pressure\"; there are: t, v (.x, .y ...), c, t (cell)"),
            std::string::npos)
      << unknown.error().text;
}

TEST(VtkArrays, LegacyFilesHaveSeveralOfAKind) {
  const TempFolder folder;
  const auto path =
      folder.write("two.vtk",
                   "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 "
                   "1 0\nPOLYGONS 1 4\n3 0 1 2\nPOINT_DATA 3\nSCALARS a float 1\nLOOKUP_TABLE default\n1 2 "
                   "3\nSCALARS b float 1\nLOOKUP_TABLE default\n4 5 6\nCELL_DATA 1\nSCALARS c int "
                   "1\nLOOKUP_TABLE default\n9\n");
  const auto arrays = mesh_arrays(path);
  ASSERT_TRUE(arrays.ok()) << arrays.error().text;
  ASSERT_EQ(arrays->size(), 3u);
  const auto b = read_mesh(path, nullptr, {}, "b");
  ASSERT_TRUE(b.ok()) << b.error().text;
  EXPECT_EQ(b->scalars, (std::vector<float>{4, 5, 6}));
}

// Two tetrahedra that share a face: six triangles are outside.
constexpr const char* kVtu = R"(<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="5" NumberOfCells="2">
<PointData><DataArray type="Float32" Name="t" format="ascii">0 1 2 3 4</DataArray></PointData>
<CellData><DataArray type="Float32" Name="c" format="ascii">10 20</DataArray></CellData>
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1 1 1 1</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3 1 2 3 4</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">4 8</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">10 10</DataArray></Cells>
</Piece></UnstructuredGrid></VTKFile>
)";

void expect_tetrahedra(const std::string& path, const std::string& format) {
  const auto cells = read_mesh(path, nullptr, {}, "c");
  ASSERT_TRUE(cells.ok()) << cells.error().text;
  EXPECT_EQ(cells->format, format);
  EXPECT_EQ(cells->indices.size(), 18u);
  EXPECT_EQ(std::multiset<float>(cells->scalars.begin(), cells->scalars.end()),
            (std::multiset<float>{10, 10, 10, 20, 20, 20}));
  const auto points = read_mesh(path, nullptr, {}, "t");
  ASSERT_TRUE(points.ok()) << points.error().text;
  ASSERT_EQ(points->scalars.size(), points->positions.size());
  for (size_t i = 0; i < points->scalars.size(); ++i)  // t is 3 at (0, 0, 1)
    EXPECT_EQ(points->scalars[i] == 3, points->positions[i] == glm::dvec3(0, 0, 1));
}

TEST(UnstructuredGrid, ItsSurfaceIsReadWithItsArrays) {
  const TempFolder folder;
  expect_tetrahedra(folder.write("two.vtu", kVtu), "vtu");
  expect_tetrahedra(
      folder.write("two.vtk",
                   "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n0 0 0 1 "
                   "0 0 0 1 0 0 0 1 1 1 1\nCELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 2\n10\n10\n"
                   "POINT_DATA 5\nSCALARS t float 1\nLOOKUP_TABLE default\n0 1 2 3 4\nCELL_DATA 2\n"
                   "SCALARS c float 1\nLOOKUP_TABLE default\n10 20\n"),
      "vtk");
}

TEST(UnstructuredGrid, WhatIsWrongIsOneLine) {
  const TempFolder folder;
  const std::string whole = kVtu;
  for (const std::string& content :
       {whole.substr(0, whole.size() / 2), std::string(whole).replace(whole.find("4 8"), 3, "4 9"),
        std::string(whole).replace(whole.find("\"5\""), 3, "\"99999999999\""),
        std::string(whole).replace(whole.find("\"2\""), 3, "\"99999999999\"")}) {
    const auto mesh = read_mesh(folder.write("bad.vtu", content), nullptr);
    if (mesh) continue;
    EXPECT_NE(mesh.error().text.find("bad.vtu"), std::string::npos);
    EXPECT_EQ(mesh.error().text.find('\n'), std::string::npos) << mesh.error().text;
  }
  EXPECT_FALSE(read_mesh(folder.write("cut.vtu", whole.substr(0, whole.size() / 2)), nullptr).ok());
}

TEST(Arrays, FormatsWithoutAnyRefuseToBeColouredByOne) {
  const TempFolder folder;
  const auto off = folder.write("t.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  const auto mesh = read_mesh(off, nullptr, {}, "t");
  ASSERT_FALSE(mesh.ok());
  EXPECT_NE(mesh.error().text.find("--colour-by t"), std::string::npos);
  EXPECT_TRUE(mesh_arrays(off)->empty());
}

// ---- stores ---------------------------------------------------------------------------------------------------------

MeshOptions coloured(const std::string& by) {
  MeshOptions options = plain_options();
  options.colouring.by = by;
  return options;
}

TEST(ArrayStore, ChunksHoldTheValuesOfVertices) {
  const TempFolder folder;
  const auto path = folder.write("square.ply", square_ply("ascii"));
  const auto store = open_or_fail(path, coloured("heat:0:5"));
  ASSERT_NE(store, nullptr);
  EXPECT_EQ(store->info().array, "heat");
  ASSERT_EQ(store->info().arrays.size(), 4u);
  const auto colouring = colouring_of(coloured("heat:0:5"), store->info());
  ASSERT_TRUE(colouring.ok() && *colouring);
  EXPECT_EQ((*colouring)->lo, 0);
  EXPECT_EQ((*colouring)->hi, 5);
  const auto chunk = geometry::decode_chunk(store->chunk({0}).bytes);
  ASSERT_TRUE(chunk.ok());
  EXPECT_TRUE(chunk->view.scalars);
  std::multiset<float> values;
  int missing = 0;
  for (const uint32_t bits : chunk->view.colours)
    if (const float v = std::bit_cast<float>(bits); std::isnan(v))
      ++missing;
    else
      values.insert(v);
  EXPECT_EQ(values, (std::multiset<float>{-1.5f, 2, 10}));
  EXPECT_EQ(missing, 1);
  const auto plain = open_or_fail(path, plain_options());
  EXPECT_FALSE(geometry::decode_chunk(plain->chunk({0}).bytes)->view.scalars);
}

TEST(ArrayStore, FacesHaveOneValueAndSmoothNormals) {
  const TempFolder folder;
  const Mesh grid = wavy_grid(8);
  std::string file = ply_of(grid);
  file.replace(file.find("end_header"), 10, "property int number\nend_header");
  size_t faces = file.find("end_header\n") + 11;
  for (size_t v = 0; v < grid.positions.size(); ++v) faces = file.find('\n', faces) + 1;
  file.resize(faces);  // the faces again, each with a number
  for (size_t f = 0; f < grid.indices.size() / 3; ++f)
    file += fmt::format("3 {} {} {} {}\n", grid.indices[3 * f], grid.indices[3 * f + 1], grid.indices[3 * f + 2], f);
  const auto path = folder.write("grid.ply", file);
  const auto store = open_or_fail(path, coloured("number")), plain = open_or_fail(path, plain_options());
  ASSERT_NE(store, nullptr);
  const Contents flat = contents_of(*store), smooth = contents_of(*plain);
  ASSERT_EQ(flat.triangles.size(), 128u);
  std::set<float> numbers;
  for (const auto& t : flat.triangles) {
    EXPECT_EQ(t[0].colour, t[1].colour);
    EXPECT_EQ(t[0].colour, t[2].colour);
    numbers.insert(std::bit_cast<float>(t[0].colour));
  }
  EXPECT_EQ(numbers.size(), 128u);
  EXPECT_EQ(*numbers.rbegin(), 127);
  // Triangles come in the same order, and their corners keep the normals that they share with their neighbours.
  for (size_t i = 0; i < flat.triangles.size(); ++i)
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(flat.triangles[i][k].position, smooth.triangles[i][k].position);
      EXPECT_EQ(flat.triangles[i][k].normal, smooth.triangles[i][k].normal);
    }
}

TEST(ArrayStore, EachArrayHasAStoreOfItsOwnThatKnowsAllArrays) {
  const TempFolder folder;
  const auto path = folder.write("square.ply", square_ply("binary_little_endian"));
  MeshOptions options = coloured("heat");
  options.use_cache = true, options.cache_dir = folder / "cache";
  for (const bool again : {false, true})
    for (const char* array : {"", "heat", "area"}) {
      const auto store = open_mesh_by(path, options, array, nullptr);
      ASSERT_TRUE(store.ok()) << store.error().text;
      EXPECT_EQ((*store)->info().from_cache, again) << array;
      EXPECT_EQ((*store)->info().array, array);
      EXPECT_EQ((*store)->info().arrays.size(), 4u);
    }
  options.colouring = {.by = "heat:-1:1", .map = "plasma"};  // map and range are not part of the store
  EXPECT_TRUE((*open_mesh(path, options, nullptr))->info().from_cache);
}

TEST(ArrayStore, WrongOptionsNameTheFlag) {
  const TempFolder folder;
  const auto path = folder.write("square.ply", square_ply("ascii"));
  const auto error = [&](const std::string& by) {
    const auto store = open_mesh(path, coloured(by), nullptr);
    return store ? std::string() : store.error().text;
  };
  EXPECT_NE(error("heat:5:1").find("--colour-by"), std::string::npos);
  EXPECT_NE(error("heat:nan:1").find("--colour-by"), std::string::npos);
  EXPECT_NE(error("cold").find("heat, id, area, after"), std::string::npos);
  EXPECT_EQ(error("none"), "");
  MeshOptions options = coloured("heat");
  options.colouring.map = "no such map";
  const auto map = colour_map_of(options);
  ASSERT_FALSE(map.ok());
  EXPECT_NE(map.error().text.find("--colour-map"), std::string::npos);
}

}  // namespace
}  // namespace telesplat::data::test
