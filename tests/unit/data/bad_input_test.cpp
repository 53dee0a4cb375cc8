// A bad file gives one clear line that names it; no crash, no hang, no memory by a file's claims.
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>

#include "services/data/gltf/container.h"
#include "services/data/inspect.h"
#include "services/data/mesh/reader.h"
#include "tests/support/files/data_files.h"
#include "tests/support/files/las_file.h"

namespace telesplat::data::test {
namespace {

using namespace std::string_literals;

long peak_rss_kb() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

// Opens a file that must be refused. Returns the error's text, after checking the properties of every such text.
std::string refusal(const std::string& path) {
  const auto store = open_mesh(path, plain_options("auto"), nullptr);
  EXPECT_FALSE(store.ok()) << path << " was accepted";
  if (store) return "";
  const std::string text = store.error().text;
  EXPECT_TRUE(text.starts_with(path)) << text;
  EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  EXPECT_LT(text.size(), path.size() + 300) << text;
  return text.substr(path.size());
}

const std::string kPlyVertex = "property float x\nproperty float y\nproperty float z\n";
const std::string kPlyFace = "property list uchar int vertex_indices\nend_header\n";
std::string ply(const std::string& vertices, const std::string& faces, const std::string& data) {
  return "ply\nformat ascii 1.0\nelement vertex " + vertices + "\n" + kPlyVertex + "element face " + faces + "\n" +
         kPlyFace + data;
}

struct BadFile {
  std::string name, content, says;  // says: must occur in the error
};

class BadInput : public testing::TestWithParam<BadFile> {};

TEST_P(BadInput, IsRefusedWithALineThatSaysWhy) {
  const TempFolder folder;
  const long before_kb = peak_rss_kb();
  const std::string text = refusal(folder.write(GetParam().name, GetParam().content));
  EXPECT_NE(text.find(GetParam().says), std::string::npos) << text;
  EXPECT_LT(peak_rss_kb() - before_kb, 64 * 1024) << "memory was taken by a claimed size";
}

const std::string kThree = "0 0 0\n1 0 0\n0 1 0\n";
const std::string kPcd = "# .PCD\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
const std::string kVtk = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET ";
const std::string kVtp =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\"><PolyData><Piece "
    "NumberOfPoints=\"";

INSTANTIATE_TEST_SUITE_P(
    Ply, BadInput,
    testing::Values(
        BadFile{"empty.ply", "", "empty"},
        BadFile{"huge.ply", ply("1000000000000", "1", "0 0 0\n"), "claims 1000000000000 of element 'vertex'"},
        BadFile{"huge-faces.ply", ply("3", "1000000000000", kThree), "claims 1000000000000 of element 'face'"},
        BadFile{"overflow.ply", ply("99999999999999999999", "1", kThree), "is not a number"},
        BadFile{"negative.ply", ply("-1", "1", kThree), "is not a number"},
        BadFile{"no-end.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", "no 'end_header'"},
        BadFile{"no-format.ply", "ply\nend_header\n", "no format"},
        BadFile{"garbage.ply", "ply\nformat ascii 1.0\nelephant 3\nend_header\n", "elephant"},
        BadFile{"bad-type.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\nend_header\n1\n", "type"},
        BadFile{"no-z.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
                "lacks x, y or z"},
        BadFile{"nan-points.ply", ply("1", "0", "0 nan 0\n"), "holds no points with finite coordinates"},
        BadFile{"out-of-range.ply", ply("3", "1", kThree + "3 0 1 3\n"), "names vertex 3, there are 3"},
        BadFile{"negative-index.ply", ply("3", "1", kThree + "3 0 1 -1\n"), "names vertex -1"},
        BadFile{"nan.ply", ply("3", "1", "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n"), "vertex 1 is not finite"},
        BadFile{"infinite.ply", ply("3", "1", "0 0 0\n1 0 0\n0 1e999 0\n3 0 1 2\n"), "vertex 2 is not finite"},
        BadFile{"truncated.ply", ply("3", "2", kThree + "3 0 1 2\n3 0 "), "truncated"},
        BadFile{"words.ply", ply("3", "1", "0 0 zero\n1 0 0\n0 1 0\n3 0 1 2\n"), "vertex 0 of 3"},
        BadFile{"long-list.ply", ply("3", "1", kThree + "200 0 1 2\n"), "truncated"},
        BadFile{"degenerate.ply", ply("3", "2", "0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n3 0 0 1\n"),
                "all its 2 triangles are degenerate"},
        BadFile{"one-point.ply", ply("3", "1", "1 1 1\n1 1 1\n1 1 1\n3 0 1 2\n"), "extent"},
        BadFile{"binary-list.ply",
                "ply\nformat binary_little_endian 1.0\nelement vertex 1\n" + kPlyVertex +
                    "element face 1\nproperty list uint int vertex_indices\nend_header\n" + std::string(12, '\0') +
                    "\xff\xff\xff\xff"s,
                "face 0 of 1"}),
    [](const auto& info) {
      auto n = info.param.name;
      std::replace_if(
          n.begin(), n.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
      return n;
    });

INSTANTIATE_TEST_SUITE_P(
    Others, BadInput,
    testing::Values(
        BadFile{"huge.off", "OFF\n1000000000000 1 0\n0 0 0\n", "claims 1000000000000 vertices"},
        BadFile{"huge-faces.off", "OFF\n3 1000000000000 0\n" + kThree, "claims 1000000000000 faces"},
        BadFile{"corners.off", "OFF\n3 1 0\n" + kThree + "4000000000 0 1 2\n", "lacks corner"},
        BadFile{"range.off", "OFF\n3 1 0\n" + kThree + "3 0 1 9\n", "names vertex 9"},
        BadFile{"short.off", "OFF\n3 1 0\n0 0 0\n1 0\n", "vertex 1 of 3"},
        BadFile{"binary.off", "OFF BINARY\n\1\2\3", "is binary, which is not read"},
        BadFile{"four.off", "4OFF\n3 1 0\n" + kThree + "3 0 1 2\n", "4OFF has vertices of other than three"},
        BadFile{"n.off", "nOFF\n3\n3 1 0\n" + kThree + "3 0 1 2\n", "nOFF has vertices of other than three"},
        BadFile{"lines.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n", "holds no faces, only 2 vertices and 1 lines"},
        BadFile{"nan.off", "OFF\n3 1 0\n0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n", "not finite"},
        BadFile{"huge.stl", std::string(80, 'x') + raw(uint32_t{4000000000}) + std::string(16, '\0'),
                "claims 4000000000 triangles"},
        BadFile{"none.stl", std::string(80, 'x') + raw(uint32_t{0}), "no triangles"},
        BadFile{"tiny.stl", "abc", "too few"},
        BadFile{"cut.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n", "truncated"},
        BadFile{"word.stl", "solid x\nfacet\nvertex 0 0 zero\nendsolid", "three numbers"},
        BadFile{"range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "names vertex 4, there are 3"},
        BadFile{"zero.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "names vertex 0"},
        BadFile{"negative.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -4 1 2\n", "names vertex -4"},
        BadFile{"normal.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//2 3//1\n", "names normal 2"},
        BadFile{"word.obj", "v 0 0 0\nv 1 0 zero\n", "three numbers"},
        BadFile{"nan.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n", "not finite"},
        BadFile{"huge.vtk", kVtk + "POLYDATA\nPOINTS 1000000000000 float\n0 0 0\n", "claims 1000000000000 POINTS"},
        BadFile{"huge-polygons.vtk",
                kVtk + "POLYDATA\nPOINTS 3 float\n" + kThree + "POLYGONS 1000000000000 4000000000000\n3 0 1 2\n",
                "POLYGONS"},
        BadFile{"range.vtk", kVtk + "POLYDATA\nPOINTS 3 float\n" + kThree + "POLYGONS 1 4\n3 0 1 77777\n", ""},
        BadFile{"cut.vtk", kVtk + "POLYDATA\nPOINTS 3 float\n0 0 0 1", ""},
        BadFile{"volume.vtk", kVtk + "STRUCTURED_POINTS\nDIMENSIONS 2 2 2\n", "is a volume"},
        BadFile{"huge.vtp", kVtp + "1000000000000\" NumberOfPolys=\"1\"/></PolyData></VTKFile>",
                "claims 1000000000000"},
        BadFile{"cut.vtp", kVtp + "3\" NumberOfPolys=\"1\"><Points>", ""},
        BadFile{"image.vti", "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"0.1\">", "is a volume"},
        BadFile{"huge.glb", "glTF" + raw(uint32_t{2}) + raw(uint32_t{4000000000}) + raw(uint32_t{12}) + "JSON{}",
                "claims 4000000000 bytes"},
        BadFile{"old.glb", "glTF" + raw(uint32_t{1}) + raw(uint32_t{20}) + raw(uint32_t{0}) + "JSON", "version 1"},
        BadFile{"broken.gltf", "{\"asset\":{\"version\":\"2.0\"},", "damaged"},
        BadFile{"huge.gltf",
                R"({"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
            "accessors":[{"count":1000000000000,"componentType":5126,"type":"VEC3"}]})",
                "claims 1000000000000 elements"},
        BadFile{"empty.gltf", R"({"asset":{"version":"2.0"}})", ""},
        BadFile{"picture.ply.png", "\x89PNG\r\n\x1a\n", "a PNG image"}, BadFile{"scan.nrrd", "NRRD0004\n", "a volume"},
        BadFile{"raster.tif", "II*\0\10\0\0\0"s, "elevation raster"},
        BadFile{"cut.tif", "II*\0\10\0\0\0\2\0\0\1\3\0\1\0\0\0\0\2"s, "elevation raster"},
        BadFile{"odd.hgt", std::string(1000, 'h'), "elevation raster"}, BadFile{"empty.hgt", "", ""},
        BadFile{"grid.asc", "ncols 3\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3\n", ""},
        BadFile{"lying.asc", "ncols 2000000000\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3\n", ""},
        BadFile{"void.asc", "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value -9\n-9 -9 -9 -9\n",
                "data"},
        BadFile{"mesh.ply.gz", "\x1f\x8b\x08", "is a compressed file (unpack it first)"},
        BadFile{"mesh.zip", "PK\3\4", "is a compressed file (unpack it first)"},
        BadFile{"model.3mf", "PK\3\4", "is a 3MF file, which is not read: save the model as STL, OBJ or PLY"},
        BadFile{"splats.sog", "PK\3\4", "holds Gaussian splats"},
        BadFile{"splats.spz", "\x1f\x8b\x08", "holds Gaussian splats"},
        BadFile{"cut.pts", "3\n1 2 3\n4 5\n", "is damaged: 2 numbers, 3 are needed: '4 5'"},
        BadFile{"words.pts", "some words\n", "does not begin with lines of three numbers"},
        BadFile{"one.xyz", "1 2 3\n1 2 3\n", "its 2 points have no extent"},
        BadFile{"cut.ptx", "90000\n90000\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 2 3 .5\n",
                "is truncated: point 1 of 8100000000 is missing"},
        BadFile{"short.las", "LASF", "is truncated: a LAS header has 227 bytes, the file 4"},
        BadFile{"lying.las", las_file({{}, {}}, {}, 4000000000), "claims 4000000000 points of 26 bytes, 2 are there"},
        BadFile{"none.las", las_file({}), "holds no points"},
        BadFile{"one.las", las_file({{}}), "its 1 points have no extent"},
        BadFile{"nan.las", las_file({{}, {1, 2, 3}}).replace(131, 8, raw(std::nan(""))), "finite coordinates"},
        BadFile{"withheld.las", las_file({{.classes = 0x80}}), "all its 1 points are marked as withheld"},
        BadFile{"new.las", las_file({{}}).replace(25, 1, "\5"), "is LAS 1.5; 1.0 to 1.4 are read"},
        BadFile{"format.las", las_file({{}}).replace(104, 1, "\13"), "points of format 11; 0 to 10 are read"},
        BadFile{"small.las", las_file({{}}).replace(105, 2, raw(uint16_t{25})), "points of 25 bytes; format 2 has"},
        BadFile{"packed.laz", las_file({{}}).replace(104, 1, "\x82"), "its record of LASzip has 0 bytes"},
        BadFile{"cloud.e57", "ASTM-E57", "is truncated: an E57 header has 48 bytes"},
        BadFile{"lying.pcd", kPcd + "POINTS 900000000000\nDATA binary\n123", "900000000000 points, the limit is"},
        BadFile{"cut.pcd", kPcd + "POINTS 2\nDATA binary\n123", "claims 2 points of 12 bytes, but only 3 bytes"},
        BadFile{"cut-text.pcd", kPcd + "POINTS 3\nDATA ascii\n1 2 3\n4 5\n", "point 1 of 3 cannot be read"},
        BadFile{"grown.pcd",
                kPcd + "POINTS 9000000\nDATA binary_compressed\n" + raw(uint32_t{3}) + raw(uint32_t{108000000}) + "abc",
                "compressed points are damaged: 0 of 108000000"},
        BadFile{"wide.pcd", kPcd + "COUNT 1 1 1000000\nPOINTS 1\nDATA binary\n", "more than 256 numbers a point"},
        BadFile{"flat.pcd", "# .PCD\nFIELDS x y\nSIZE 4 4\nTYPE F F\nPOINTS 1\nDATA ascii\n1 2\n", "lack x, y or z"},
        BadFile{"no-data.pcd", "# .PCD\nFIELDS x y z\n", "has no line DATA"},
        BadFile{
            "splats.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\n" + kPlyVertex + "property float f_dc_0\nend_header\n1 2 3 4\n",
            "holds 1 Gaussian splats"},
        BadFile{"notes.txt", "Dear diary,\nnothing happened.\n", "volumes (NRRD, MetaImage"}),
    [](const auto& info) {
      auto n = info.param.name;
      std::replace_if(
          n.begin(), n.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
      return n;
    });

TEST(BadPath, MissingFolderUnreadable) {
  const TempFolder folder;
  EXPECT_NE(refusal(folder / "nothing.ply").find("cannot be opened"), std::string::npos);
  std::filesystem::create_directory(folder / "folder.ply");
  EXPECT_NE(refusal(folder / "folder.ply").find("is a folder without mesh files"), std::string::npos);
  EXPECT_NE(refusal("/dev/null").find("not a regular file"), std::string::npos);
  EXPECT_FALSE(is_mesh_file(folder / "nothing.ply"));
  if (geteuid() == 0) GTEST_SKIP() << "root may read everything";
  const std::string secret = folder.write("secret.ply", ply_of(wavy_grid(2)));
  std::filesystem::permissions(secret, std::filesystem::perms::none);
  EXPECT_NE(refusal(secret).find("cannot be opened"), std::string::npos);
}

TEST(BadOptions, AreRefused) {
  const TempFolder folder;
  const std::string path = folder.write("grid.ply", ply_of(wavy_grid(2)));
  const auto store = open_mesh(path, plain_options("w"), nullptr);
  ASSERT_FALSE(store.ok());
  EXPECT_NE(store.error().text.find("'w'"), std::string::npos);
}

// Any beginning of a good file is refused or read, without a crash.
TEST(Truncation, AtEveryLengthOfEachTextFormat) {
  const Mesh grid = wavy_grid(2);
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n",
                    off = "COFF\n3 1 0\n0 0 0 1 2 3\n1 0 0 1 2 3\n0 1 0 1 2 3\n3 0 1 2\n";
  const std::string stl =
      "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid "
      "x\n";
  size_t refused = 0;
  const auto try_all = [&](const std::string& whole, auto reader) {
    ASSERT_TRUE(reader(whole, "whole", nullptr).ok());
    for (size_t length = 0; length < whole.size(); ++length) {
      const std::vector<char> exact(
          whole.begin(), whole.begin() + static_cast<long>(length));  // so that sanitizers see every step beyond
      refused += !reader(std::string_view(exact.data(), length), "cut", nullptr).ok();
    }
  };
  FolderCompanions none("/nonexistent/file");
  try_all(ply_of(grid), [&](auto... given) { return read_ply(given..., none); });
  try_all(obj, [&](auto... given) { return read_obj(given..., none); });
  try_all(off, read_off);
  try_all(stl, read_stl);
  EXPECT_GT(refused, 300u);
}

// The JSON may contain buffers as texts; any other content takes many times its size of memory.
TEST(GltfJson, IsNoLargerThanItsLimitBesideTexts) {
  const std::string begin = R"({"asset":{"version":"2.0"},"x":")", end = R"("})";
  const std::string text = begin + std::string(kMostGltfJson, 'A') + R"(\"x)" + end;
  EXPECT_TRUE(gltf_json_fits(text));
  const std::string numbers = R"({"asset":{"version":"2.0"},"x":[)" + std::string(kMostGltfJson, ' ') + "1]}";
  EXPECT_FALSE(gltf_json_fits(numbers));
  const TempFolder folder;
  EXPECT_EQ(refusal(folder.write("a.gltf", numbers)), ": its glTF JSON has more than 67108864 bytes outside of texts");
  EXPECT_TRUE(companion_files(numbers, "gltf", "a.gltf").empty());
}

}  // namespace
}  // namespace telesplat::data::test
