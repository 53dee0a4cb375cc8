// Files of VTK that name others: parallel forms, blocks, time series.
#include "tests/unit/data/vtk/vtk_files.h"

namespace telesplat::data::test {
namespace {

std::string naming(const std::string& type, const std::string& content) { return VtkWriter().file(type, content); }

TEST(VtkComposite, FacesBetweenPiecesAreGone) {
  const TempFolder folder;
  folder.write("p0.vtu", vtu(bricks(2), {VtkEncoding::Mode::kAppendedRaw, "LZ4"}));
  folder.write("p1.vtu", vtu(bricks(1, 2)));
  const std::string path =
      folder.write("a.pvtu", naming("PUnstructuredGrid",
                                    "<PUnstructuredGrid GhostLevel='0'><Piece Source='p0.vtu'/><Piece "
                                    "Source='p1.vtu'/></PUnstructuredGrid>"));
  const Mesh mesh = mesh_or_fail(path, "number");
  EXPECT_EQ(mesh.format, "pvtu");
  expect_shape(mesh, 28, 14, 3);
  EXPECT_EQ(mesh.arrays[0].spans[0].hi, 5.5);
  EXPECT_EQ(mesh.scalars.size(), 28u);
  std::filesystem::remove(folder / "p1.vtu");
  const auto cut = read_mesh(path, nullptr);
  ASSERT_FALSE(cut);
  EXPECT_NE(cut.error().text.find("p1.vtu"), std::string::npos) << cut.error().text;
}

// VTK writes data that it cannot cut like this: each piece has all cells, without a mark.
TEST(VtkComposite, ACellThatSeveralPiecesHaveIsOne) {
  const TempFolder folder;
  for (const char* name : {"p0.vtu", "p1.vtu", "p2.vtu"}) folder.write(name, vtu(bricks(2)));
  expect_shape(mesh_or_fail(folder.write("a.pvtu", naming("PUnstructuredGrid",
                                                          "<PUnstructuredGrid GhostLevel='0'><Piece Source='p0.vtu'/>"
                                                          "<Piece Source='p1.vtu'/><Piece Source='p2.vtu'/>"
                                                          "</PUnstructuredGrid>"))),
               20, 10, 2);
}

TEST(VtkComposite, StructuredPiecesMeet) {
  const TempFolder folder;
  VtkWriter w;
  const auto piece = [&](int first) {
    const std::string extent = fmt::format("{} {} 0 1 0 1", first, first + 1);
    const auto axis = [&](double from) { return w.array("Float32", "", std::vector<double>{from, from + 1}); };
    return naming("RectilinearGrid",
                  fmt::format("<RectilinearGrid WholeExtent='{0}'><Piece Extent='{0}'><Coordinates>{1}{2}{2}"
                              "</Coordinates></Piece></RectilinearGrid>",
                              extent, axis(first), axis(0)));
  };
  folder.write("0.vtr", piece(0));
  folder.write("1.vtr", piece(1));
  expect_shape(
      mesh_or_fail(folder.write("a.pvtr", naming("PRectilinearGrid",
                                                 "<PRectilinearGrid WholeExtent='0 2 0 1 0 1'><Piece Source='0.vtr'/>"
                                                 "<Piece Source='1.vtr'/></PRectilinearGrid>"))),
      20, 10, 2);
}

// A block of cells, and in a folder a patch of their surface with other data.
TEST(VtkComposite, BlocksNestAndPatchesCoverFaces) {
  const TempFolder folder;
  std::filesystem::create_directory(folder / "case");
  folder.write("case/internal.vtu", vtu(bricks(2)));
  folder.write("case/wall.vtp", naming("PolyData",
                                       "<PolyData><Piece NumberOfPoints='4' NumberOfPolys='1'><Points><DataArray "
                                       "type='Float32' NumberOfComponents='3'>0 0 0 0 0 1 0 1 1 0 1 0</DataArray>"
                                       "</Points><Polys><DataArray type='Int32' Name='connectivity'>3 2 1 0"
                                       "</DataArray><DataArray type='Int32' Name='offsets'>4</DataArray></Polys>"
                                       "<CellData><DataArray type='Int32' Name='number'>9</DataArray></CellData>"
                                       "</Piece></PolyData>"));
  folder.write("case/inner.vtm", naming("vtkMultiBlockDataSet",
                                        "<vtkMultiBlockDataSet><DataSet file='internal.vtu'/></vtkMultiBlockDataSet>"));
  const Mesh mesh = mesh_or_fail(
      folder.write("a.vtm",
                   naming("vtkMultiBlockDataSet",
                          "<vtkMultiBlockDataSet><Block name='b'><DataSet name='i' file='case/inner.vtm'/><Block>"
                          "<DataSet file='case/wall.vtp'/><DataSet/></Block></Block></vtkMultiBlockDataSet>")),
      "number");
  EXPECT_EQ(mesh.format, "vtm");
  expect_shape(mesh, 20, 10, 2);
  EXPECT_EQ(std::count(mesh.scalars.begin(), mesh.scalars.end(), 9.0f), 2);
  const std::string content =
      naming("Collection", "<Collection><DataSet timestep='0' file='case/inner.vtm'/></Collection>");
  EXPECT_EQ(companion_files(content, "pvd", folder / "a.pvd"),
            (std::vector<std::string>{folder / "case/inner.vtm", folder / "case/internal.vtu"}));
}

TEST(VtkComposite, OfTimeStepsTheFirstIsShownWithAllItsParts) {
  const TempFolder folder;
  folder.write("p0.vtu", vtu(bricks(1)));
  folder.write("p1.vtu", vtu(bricks(1, 1)));
  folder.write("later.vtu", vtu(bricks(5)));
  const Mesh mesh = mesh_or_fail(folder.write(
      "a.pvd", naming("Collection",
                      "<Collection><DataSet timestep='0.5' part='0' file='p0.vtu'/><DataSet timestep='0.5' "
                      "part='1' file='p1.vtu'/><DataSet timestep='1' file='later.vtu'/></Collection>")));
  expect_shape(mesh, 20, 10, 2);
  ASSERT_EQ(mesh.notes.size(), 1u);
  EXPECT_NE(mesh.notes[0].find("holds 2 time steps; the first one is shown (0.5)"), std::string::npos) << mesh.notes[0];
}

TEST(VtkComposite, FilesThatNameThemselvesEnd) {
  const TempFolder folder;
  const std::string self = "<DataSet file='a.vtm'/>";
  const auto mesh = read_mesh(
      folder.write("a.vtm",
                   naming("vtkMultiBlockDataSet", "<vtkMultiBlockDataSet>" + self + self + "</vtkMultiBlockDataSet>")),
      nullptr);
  ASSERT_FALSE(mesh);
  EXPECT_NE(mesh.error().text.find("files name files"), std::string::npos) << mesh.error().text;
}

}  // namespace
}  // namespace telesplat::data::test
