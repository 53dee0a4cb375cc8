// A VTK file's active scalars colour a mesh by default.
#include "services/data/mesh/reader.h"

#include <limits>

#include "common/scene/colouring.h"
#include "services/data/data_options.h"
#include "services/data/kinds.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

const std::string kXml =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\">\n<PolyData><Piece>\n<PointData Scalars=\"temperature\" "
    "Normals=\"n\">\n</PointData><CellData Scalars=\"age\"></CellData></Piece></PolyData>\n<AppendedData>_\1<CellData ";

std::string piece(const std::string& data, const std::string& behind = "</VTKFile>") {
  return "<VTKFile type='PolyData'><PolyData><Piece>" + data + "</Piece></PolyData>" + behind;
}

// Two triangles with heat of points and, after it, id of cells.
std::string legacy(const std::string& scalars = "SCALARS heat float 1\nLOOKUP_TABLE default\n0 1 2 30\n") {
  return "# vtk DataFile Version 3.0\na plate\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1 0\n"
         "POLYGONS 2 8\n3 0 1 2\n3 0 2 3\nPOINT_DATA 4\n" +
         scalars + "CELL_DATA 2\nSCALARS id float 1\nLOOKUP_TABLE default\n7 9\n";
}

TEST(ActiveArray, IsReadFromTheWordsOfTheFile) {
  EXPECT_EQ(active_array(kXml), "temperature");
  EXPECT_EQ(active_array(piece("<PointData/><CellData Scalars = 'a&amp;b'/>")), "a&b");
  EXPECT_EQ(active_array(piece("<PointData Vectors=\"v\"/><CellData/>")), "");
  EXPECT_EQ(active_array(piece("<!-- <PointData Scalars=\"x\"/> -->")), "") << "a comment";
  EXPECT_EQ(active_array(piece("", "<AppendedData>_<PointData Scalars=\"x\">")), "") << "text behind it is no markup";
  EXPECT_EQ(active_array(legacy()), "heat");
  EXPECT_EQ(active_array(legacy("")), "id") << "of cells, where points have none";
  EXPECT_EQ(active_array("ply\nformat ascii 1.0\n"), "");
  EXPECT_EQ(active_array(piece("<PointData Scalars=\"RGB\"/>")), "") << "colours are colours";
  for (size_t n = 0; n < kXml.size(); n += 3) active_array(std::string_view(kXml).substr(0, n));
}

class ActiveFile : public testing::Test {
 protected:
  TempFolder folder;
  Result<std::shared_ptr<MeshStore>> open(DataOptions& o) {
    o.mesh.use_cache = false;
    return open_mesh(o.scene, o.mesh_options(), {});
  }
};

TEST_F(ActiveFile, IsColouredByItUnlessToldOtherwise) {
  DataOptions o;
  o.scene = folder.write("plate.vtk", legacy());
  const auto by_itself = open(o);
  ASSERT_TRUE(by_itself) << by_itself.error().text;
  EXPECT_EQ((*by_itself)->info().array, "heat");
  const auto colouring = colouring_of(o.mesh_options(), (*by_itself)->info());
  ASSERT_TRUE(colouring && *colouring);
  EXPECT_EQ((*colouring)->hi, 30);
  o.mesh.colouring.by = "none";
  const auto plain = open(o);
  ASSERT_TRUE(plain);
  EXPECT_EQ((*plain)->info().array, "");
  EXPECT_FALSE(*colouring_of(o.mesh_options(), (*plain)->info()));
  o.mesh.colouring.by = "id:0:10";
  EXPECT_EQ((*open(o))->info().array, "id");
}

TEST_F(ActiveFile, WithoutAFiniteValueShowsItsOwnColours) {
  std::string file = "# vtk DataFile Version 3.0\nan empty plate\nBINARY\nDATASET POLYDATA\nPOINTS 4 float\n";
  for (const float v : {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}) file += raw(v, true);
  file += "\nPOLYGONS 2 8\n";
  for (const int32_t v : {3, 0, 1, 2, 3, 0, 2, 3}) file += raw(v, true);
  file += "\nPOINT_DATA 4\nSCALARS heat float 1\nLOOKUP_TABLE default\n";
  for (int i = 0; i < 4; ++i) file += raw(std::numeric_limits<float>::quiet_NaN(), true);
  DataOptions o;
  o.scene = folder.write("empty.vtk", file + "\n");
  ASSERT_EQ(active_array(file), "heat");
  const auto store = open(o);
  ASSERT_TRUE(store) << store.error().text;
  EXPECT_EQ((*store)->info().array, "");
  const auto colouring = colouring_of(o.mesh_options(), (*store)->info());
  ASSERT_TRUE(colouring) << colouring.error().text;
  EXPECT_FALSE(*colouring);
}

}  // namespace
}  // namespace telesplat::data::test
