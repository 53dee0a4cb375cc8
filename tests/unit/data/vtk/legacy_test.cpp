// Legacy files of VTK.
#include <random>

#include "tests/unit/data/vtk/vtk_files.h"

namespace telesplat::data::test {
namespace {

// Writes numbers as text, or as big-endian bytes.
class Legacy {
 public:
  explicit Legacy(bool binary, const char* version = "3.0")
      : binary_(binary),
        text_(fmt::format("# vtk DataFile Version {}\na title\n{}\n", version, binary ? "BINARY" : "ASCII")) {}
  Legacy& line(const std::string& words) {
    text_ += words + "\n";
    return *this;
  }
  template <class T>
  Legacy& numbers(const std::vector<T>& values) {
    for (const T v : values) text_ += binary_ ? raw(v, true) : fmt::format("{} ", v);
    text_ += "\n";
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  bool binary_;
  std::string text_;
};

Legacy bricks_in(bool binary, bool with_offsets) {
  const Grid grid = bricks(2);
  std::vector<int32_t> list;
  std::vector<int64_t> ids, ends{0};
  for (const auto& cell : grid.cells) {
    list.push_back(int32_t(cell.size()));
    for (const int64_t id : cell) list.push_back(int32_t(id)), ids.push_back(id);
    ends.push_back(int64_t(ids.size()));
  }
  Legacy out(binary, with_offsets ? "5.1" : "2.0");
  out.line("dataset UNSTRUCTURED_GRID").line("POINTS 12 double").numbers(grid.points);
  if (with_offsets)
    out.line("CELLS 3 16").line("OFFSETS vtktypeint64").numbers(ends).line("CONNECTIVITY vtktypeint64").numbers(ids);
  else
    out.line("CELLS 2 18").numbers(list);
  return out.line("CELL_TYPES 2").numbers(std::vector<int32_t>{12, 12});
}

TEST(VtkLegacy, BothLayoutsOfCellsInTextAndBinary) {
  const TempFolder folder;
  for (const bool binary : {false, true})
    for (const bool with_offsets : {false, true})
      expect_shape(mesh_or_fail(folder.write("a.vtk", bricks_in(binary, with_offsets).text())), 20, 10, 2);
}

TEST(VtkLegacy, StructuredAndRectilinearGrids) {
  const TempFolder folder;
  for (const bool binary : {false, true}) {
    Legacy grid(binary), axes(binary);
    grid.line("DATASET STRUCTURED_GRID").line("DIMENSIONS 3 2 2").line("POINTS 12 double").numbers(bricks(2).points);
    axes.line("DATASET RECTILINEAR_GRID").line("DIMENSIONS 3 2 2");
    axes.line("X_COORDINATES 3 float").numbers(std::vector<float>{0, 1, 2});
    axes.line("Y_COORDINATES 2 short").numbers(std::vector<int16_t>{0, 1});
    axes.line("Z_COORDINATES 2 double").numbers(std::vector<double>{0, 1});
    expect_shape(mesh_or_fail(folder.write("a.vtk", grid.text())), 20, 10, 2);
    expect_shape(mesh_or_fail(folder.write("b.vtk", axes.text())), 20, 10, 2);
  }
}

// A file with every section that may stand among the data.
std::string with_all_kinds(bool binary) {
  Legacy out(binary);
  const std::vector<float> four{1, 2, 3, 4}, twelve{1, 0, 0, 0, 2, 0, 0, 0, 2, 3, 4, 0};
  out.line("DATASET POLYDATA").line("FIELD FieldData 2").line("TIME 1 1 double").numbers(std::vector<double>{7});
  out.line("names 1 2 string")
      .line(binary ? std::string("\xc3"
                                 "abc\xc1"
                                 "d")
                   : "abc\nd");
  out.line("POINTS 4 float").numbers(std::vector<float>{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
  out.line("METADATA")
      .line("INFORMATION 1")
      .line("NAME L2_NORM_RANGE LOCATION vtkDataArray")
      .line("DATA 2 0 1")
      .line("");
  out.line("POLYGONS 1 5").numbers(std::vector<int32_t>{4, 0, 1, 2, 3});
  out.line("POINT_DATA 4").line("SCALARS heat%20flux float 1").line("LOOKUP_TABLE mine").numbers(four);
  out.line("METADATA").line("INFORMATION 1").line("NAME UNITS_LABEL LOCATION vtkDataArray").line("DATA W/m2").line("");
  out.line("LOOKUP_TABLE mine 1");
  binary ? out.numbers(std::vector<uint8_t>{1, 2, 3, 255}) : out.numbers(std::vector<float>{0, 0, 0, 1});
  out.line("VECTORS v float").numbers(twelve).line("NORMALS n float").numbers(twelve);
  out.line("TEXTURE_COORDINATES uv 2 float").numbers(std::vector<float>{0, 0, 1, 0, 1, 1, 0, 1});
  out.line("TENSORS stress double").numbers(std::vector<double>(36, 3));
  out.line("FIELD more 1").line("age 1 4 long").numbers(std::vector<int64_t>{5, 6, 7, 8});
  out.line("CELL_DATA 1").line("COLOR_SCALARS paint 3");
  binary ? out.numbers(std::vector<uint8_t>{220, 30, 30}) : out.numbers(std::vector<float>{0.8627f, 0.1176f, 0.1176f});
  return out.text();
}

TEST(VtkLegacy, ArraysOfAllKinds) {
  const TempFolder folder;
  for (const bool binary : {false, true}) {
    SCOPED_TRACE(binary);
    const Mesh mesh = mesh_or_fail(folder.write("a.vtk", with_all_kinds(binary)));
    EXPECT_EQ(shape_of(mesh).area, 1);
    std::vector<std::string> names;
    for (const auto& array : mesh.arrays) names.push_back(array.name);
    EXPECT_EQ(names, (std::vector<std::string>{"heat flux", "v", "n", "uv", "stress", "age", "paint"}));
    EXPECT_EQ(mesh.arrays[0].unit, "W/m2");
    EXPECT_EQ(mesh.arrays[1].spans[0], (scene::ValueSpan{1, 5}));
    EXPECT_EQ(mesh.arrays[5].spans[0], (scene::ValueSpan{5, 8}));
    ASSERT_EQ(mesh.normals.size(), 4u);
    EXPECT_EQ(mesh.normals[1], glm::vec3(0, 2, 0));
    for (const uint32_t colour : mesh.colours) EXPECT_EQ(colour, pack_rgb(220, 30, 30));
  }
}

TEST(VtkLegacy, RefusesGridsThatTheirFileCannotHold) {
  const TempFolder folder;
  const auto says = [&](const std::string& dimensions, const std::string& again) {
    const auto mesh = read_mesh(
        folder.write("a.vtk",
                     "# vtk DataFile Version 3.0\nx\nASCII\nDATASET RECTILINEAR_GRID\nDIMENSIONS " + dimensions +
                         "\nX_COORDINATES 2 float\n0 1\nY_COORDINATES 2 float\n0 1\nZ_COORDINATES 2 float\n0 1\n" +
                         again),
        nullptr);
    return mesh ? std::string("a mesh") : mesh.error().text;
  };
  EXPECT_EQ(says("2 2 2", ""), "a mesh");
  EXPECT_NE(says("2 2 2", "DIMENSIONS 9 9 9\n").find("are missing"), std::string::npos);
  EXPECT_NE(says("1500 1500 1500", "").find("claims 3375000000 points"), std::string::npos);
}

TEST(VtkLegacy, SurvivesCutAndChangedFiles) {
  const TempFolder folder;
  std::mt19937 random(3);
  for (const std::string& whole : {with_all_kinds(false), with_all_kinds(true), bricks_in(true, true).text(),
                                   bricks_in(false, false).text(), bricks_in(true, false).text()}) {
    const auto read = [&](const std::string& content) {
      const auto mesh = read_mesh(folder.write("a.vtk", content), nullptr);
      if (!mesh) {
        EXPECT_NE(mesh.error().text.find("a.vtk"), std::string::npos) << mesh.error().text;
      }
    };
    for (size_t bytes = 1; bytes < whole.size(); bytes += 7) read(whole.substr(0, bytes));
    for (int n = 0; n < 400; ++n) {
      std::string changed = whole;
      for (int k = 0; k < 3; ++k) changed[random() % changed.size()] = char(random());
      read(changed);
    }
  }
}

}  // namespace
}  // namespace telesplat::data::test
