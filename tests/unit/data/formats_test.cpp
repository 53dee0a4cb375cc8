// Each format, written as programs write it, gives the same mesh.
#include "services/data/mesh/reader.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

using namespace std::string_literals;

// A unit square of two triangles, folded along its diagonal.
const std::vector<glm::dvec3> kPositions = {{0, 0, 0}, {1, 0, 0.5}, {1, 1, 0}, {0, 1, 0.5}};
const std::vector<uint32_t> kIndices = {0, 1, 2, 0, 2, 3};
const std::vector<uint32_t> kColours = {0xff0000, 0x00ff00, 0x0000ff, 0x102030};

Mesh read(const std::string& path) {
  auto mesh = read_mesh(path, nullptr);
  EXPECT_TRUE(mesh.ok()) << (mesh ? "" : mesh.error().text);
  return mesh ? std::move(*mesh) : Mesh();
}

void expect_square(const Mesh& mesh, bool coloured) {
  EXPECT_EQ(mesh.positions, kPositions);
  EXPECT_EQ(mesh.indices, kIndices);
  if (coloured)
    EXPECT_EQ(mesh.colours, kColours);
  else
    EXPECT_TRUE(mesh.colours.empty());
}

class Ply : public testing::TestWithParam<std::tuple<std::string, std::string, std::string>> {};

// encoding x coordinate type x index type
TEST_P(Ply, ReadsPositionsNormalsColoursAndFaces) {
  const auto& [encoding, real, index] = GetParam();
  const bool ascii = encoding == "ascii", big = encoding == "binary_big_endian";
  std::string file = fmt::format(
      "ply\nformat {} 1.0\ncomment by hand\nelement vertex 4\nproperty {} x\nproperty {} y\nproperty {} z\n"
      "property float nx\nproperty float ny\nproperty float nz\nproperty float confidence\nproperty uchar "
      "red\nproperty uchar green\n"
      "property uchar blue\nproperty uchar alpha\nelement face 2\nproperty uchar flags\nproperty list uchar {} "
      "vertex_indices\n"
      "element edge 1\nproperty int a\nproperty int b\nend_header\n",
      encoding, real, real, real, index);
  const auto put = [&](auto value) { file += ascii ? fmt::format("{} ", +value) : raw(value, big); };
  const auto put_real = [&, &real = real](double v) { real == "double" ? put(v) : put(static_cast<float>(v)); };
  const auto put_index = [&, &index = index](uint32_t v) {
    if (index == "uchar")
      put(static_cast<uint8_t>(v));
    else if (index == "ushort")
      put(static_cast<uint16_t>(v));
    else
      put(v);
  };
  for (int v = 0; v < 4; ++v) {
    for (int a = 0; a < 3; ++a) put_real(kPositions[v][a]);
    put(0.0f), put(0.0f), put(2.0f), put(0.25f);
    for (int shift : {16, 8, 0}) put(static_cast<uint8_t>(kColours[v] >> shift));
    put(uint8_t{255});
  }
  for (int f = 0; f < 2; ++f) {
    put(uint8_t{7}), put(uint8_t{3});
    for (int k = 0; k < 3; ++k) put_index(kIndices[3 * f + k]);
  }
  put(int32_t{0}), put(int32_t{1});
  const TempFolder folder;
  const Mesh mesh = read(folder.write("square.ply", file));
  expect_square(mesh, true);
  ASSERT_EQ(mesh.normals.size(), 4u);
  EXPECT_EQ(mesh.normals[3], glm::vec3(0, 0, 2));
}
INSTANTIATE_TEST_SUITE_P(All, Ply,
                         testing::Combine(testing::Values("ascii", "binary_little_endian", "binary_big_endian"),
                                          testing::Values("float", "double"),
                                          testing::Values("uchar", "ushort", "int", "uint")));

TEST(PlyReader, PolygonsBecomeFansAndStripsTriangles) {
  const TempFolder folder;
  const std::string vertices = "property float x\nproperty float y\nproperty float z\n";
  const std::string five = "0 0 0\n1 0 0\n1 1 0\n0.5 1.5 0\n0 1 0\n";
  const Mesh polygon =
      read(folder.write("polygon.ply", "ply\r\nformat ascii 1.0\r\nelement vertex 5\r\n" + vertices +
                                           "element face 2\nproperty list uchar int vertex_index\nend_header\r\n" +
                                           five + "5 0 1 2 3 4\n2 0 1"));
  EXPECT_EQ(polygon.indices, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3, 0, 3, 4}));
  EXPECT_EQ(polygon.degenerate_dropped, 1u);
  const Mesh strip =
      read(folder.write("strip.ply", "ply\nformat ascii 1.0\nelement vertex 5\n" + vertices +
                                         "element tristrips 1\nproperty list int int vertex_indices\nend_header\n" +
                                         five + "8 0 1 2 3 -1 2 3 4\n"));
  EXPECT_EQ(strip.indices, (std::vector<uint32_t>{0, 1, 2, 1, 3, 2, 2, 3, 4}));
}

TEST(PlyReader, ColoursOfOtherTypes) {
  const TempFolder folder;
  const auto with = [&](const std::string& type, const std::string& colour) {
    std::string file =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    for (const char* channel : {"red", "green", "blue"}) file += "property " + type + " diffuse_" + channel + "\n";
    file += "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    for (const char* p : {"0 0 0 ", "1 0 0 ", "0 1 0 "}) file += p + colour + "\n";
    return read(folder.write(type + ".ply", file + "3 0 1 2\n")).colours.at(0);
  };
  EXPECT_EQ(with("uchar", "255 128 1"), 0xff8001u);
  EXPECT_EQ(with("ushort", "65535 32896 257"), 0xff8001u);
  EXPECT_EQ(with("float", "1.0 0.50196 0.004"), 0xff8001u);
}

TEST(OffReader, PlainWithCommentsAndCrLf) {
  const TempFolder folder;
  expect_square(
      read(folder.write(
          "a.off",
          "OFF\r\n# a comment\r\n4 2 0 # counts\r\n0 0 0\r\n1 0 0.5\r\n\r\n1 1 0\r\n0 1 .5\r\n3 0 1 2\r\n3 0 2 3\r\n")),
      false);
  expect_square(read(folder.write("b.off", "OFF 4 2 5\n0 0 0\n1 0 0.5\n1 1 0\n0 1 0.5\n3 0 1 2\n3 0 2 3")), false);
  expect_square(read(folder.write("c.off", "4 2\n0 0 0\n1 0 0.5\n1 1 0\n0 1 0.5\n3 0 1 2\n3 0 2 3")), false);
  expect_square(read(folder.write("d.off", "OFF\n4\n2\n0\n0 0 0\n1 0 0.5\n1 1 0\n0 1 0.5\n3 0 1 2\n3 0 2 3")), false);
  expect_square(read(folder.write("quad.off", "OFF\n4 1 0\n0 0 0\n1 0 0.5\n1 1 0\n0 1 0.5\n4 0 1 2 3\n")), false);
}

TEST(OffReader, ColoursAndNormals) {
  const TempFolder folder;
  expect_square(read(folder.write("c.off",
                                  "COFF\n4 2 0\n0 0 0 255 0 0 255\n1 0 .5 0 255 0 255\n1 1 0 0 0 255 255\n0 1 .5 16 32 "
                                  "48 255\n3 0 1 2\n3 0 2 3\n")),
                true);
  expect_square(
      read(folder.write(
          "f.off",
          "COFF\n4 2 0\n0 0 0 1.0 0 0\n1 0 .5 0 1 0\n1 1 0 0 0 1\n0 1 .5 .063 .1255 .188 # rgb\n3 0 1 2\n3 0 2 3\n")),
      true);
  expect_square(
      read(folder.write("meshlab.off",
                        "CSTOFF\n4 2 0\n0 0 0 255 0 0 255 0 0\n1 0 .5 0 255 0 255 1 0\n1 1 0 0 0 255 255 1 1\n"
                        "0 1 .5 16 32 48 255 0 1\n3 0 1 2\n3 0 2 3\n")),
      true);
  const Mesh both = read(
      folder.write("cn.off", "CNOFF\n3 1 0\n0 0 0 0 0 1 255 0 0\n1 0 0 0 0 1 255 0 0\n0 1 0 0 0 1 0 255 0\n3 0 1 2\n"));
  EXPECT_EQ(both.normals, std::vector<glm::vec3>(3, {0, 0, 1}));
  EXPECT_EQ(both.colours, (std::vector<uint32_t>{0xff0000, 0xff0000, 0x00ff00}));
}

std::string binary_stl(const std::string& title) {
  std::string file = title + std::string(80 - title.size(), ' ') + raw(uint32_t{2});
  for (int t = 0; t < 2; ++t) {
    file += std::string(12, '\0');
    for (int k = 0; k < 3; ++k)
      for (int a = 0; a < 3; ++a) file += raw(static_cast<float>(kPositions[kIndices[3 * t + k]][a]));
    file += "\0\0"s;
  }
  return file;
}

TEST(StlReader, BinaryAndAscii) {
  const TempFolder folder;
  expect_square(read(folder.write("binary.stl", binary_stl("made by a test"))), false);
  expect_square(read(folder.write("lying.stl", binary_stl("solid but binary"))), false);
  expect_square(read(folder.write("no-extension", binary_stl("made by a test"))), false);
  std::string ascii = "solid square\n";
  for (int t = 0; t < 2; ++t) {
    ascii += " facet normal 0 0 1\n  outer loop\n";
    for (int k = 0; k < 3; ++k) {
      const auto& p = kPositions[kIndices[3 * t + k]];
      ascii += fmt::format("   vertex {:e} {:e} {:e}\n", p.x, p.y, p.z);
    }
    ascii += "  endloop\n endfacet\n";
  }
  expect_square(read(folder.write("ascii.stl", ascii + "endsolid square\n")), false);
}

TEST(ObjReader, FacesInAllTheirForms) {
  const TempFolder folder;
  const std::string v = "# square\nv 0 0 0\nv 1 0 0.5\r\nv 1 1 0\nv 0 1 0.5\nvt 0 0\nvn 0 0 1\n";
  expect_square(read(folder.write("plain.obj", v + "f 1 2 3\nf 1 3 4\n")), false);
  expect_square(read(folder.write("quad.obj", v + "o a\ng b\ns off\nf 1/1/1 2/1/1 3/1/1 4/1/1\n")), false);
  expect_square(read(folder.write("slashes.obj", v + "f 1//1 2//1 3//1\nf 1//1 3//1 4//1")), false);
  expect_square(read(folder.write("negative.obj", v + "f -4 -3 -2\nf -4/-1 -2/-1 -1/-1\n")), false);
  expect_square(read(folder.write("continued.obj", v + "f 1 2 \\\n3 4 # the end\n")), false);
  EXPECT_EQ(read(folder.write("normals.obj", v + "f 1//1 2//1 3//1\n")).normals, std::vector<glm::vec3>(3, {0, 0, 1}));
}

TEST(ObjReader, ColoursOfVerticesAndOfMaterials) {
  const TempFolder folder;
  expect_square(read(folder.write(
                    "v.obj", "v 0 0 0 1 0 0\nv 1 0 .5 0 1 0\nv 1 1 0 0 0 1\nv 0 1 .5 .0628 .1255 .1883\nf 1 2 3 4\n")),
                true);
  folder.write("colours.mtl", "newmtl red\nKa 0 0 0\nKd 1 0 0\nnewmtl grey\nKd 0.5 0.5 0.5\n");
  const Mesh mesh = read(folder.write(
      "m.obj",
      "mtllib colours.mtl\nv 0 0 0\nv 1 0 .5\nv 1 1 0\nv 0 1 .5\nusemtl red\nf 1 2 3\nusemtl grey\nf 1 3 4\n"));
  ASSERT_EQ(mesh.positions.size(), 6u);  // corners between two materials exist twice
  EXPECT_EQ(mesh.colours, (std::vector<uint32_t>{0xff0000, 0xff0000, 0xff0000, 0x808080, 0x808080, 0x808080}));
}

TEST(VtkReader, LegacyPolyData) {
  const TempFolder folder;
  const std::string file =
      "# vtk DataFile Version 3.0\nsquare\nASCII\nDATASET POLYDATA\nPOINTS 4 double\n0 0 0 1 0 0.5 1 1 0 0 1 "
      "0.5\nPOLYGONS 2 8\n3 0 1 2\n3 0 2 3\n"
      "POINT_DATA 4\nCOLOR_SCALARS colours 3\n1 0 0 0 1 0 0 0 1 0.0628 0.1255 0.1883\nNORMALS n float\n0 0 1 0 0 1 0 0 "
      "1 0 0 1\n";
  const Mesh mesh = read(folder.write("square.vtk", file));
  expect_square(mesh, true);
  EXPECT_EQ(mesh.format, "vtk");
  EXPECT_EQ(mesh.normals, std::vector<glm::vec3>(4, {0, 0, 1}));
}

TEST(VtkReader, XmlPolyDataWithStrips) {
  const TempFolder folder;
  const std::string file =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\"><PolyData>"
      "<Piece NumberOfPoints=\"4\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"1\" NumberOfPolys=\"1\">"
      "<PointData Scalars=\"rgb\"><DataArray type=\"UInt8\" Name=\"rgb\" NumberOfComponents=\"3\" format=\"ascii\">255 "
      "0 0 0 255 0 0 0 255 16 32 48</DataArray></PointData>"
      "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0.5 1 1 0 0 1 "
      "0.5</DataArray></Points>"
      "<Strips><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 2 3</DataArray><DataArray "
      "type=\"Int32\" Name=\"offsets\" format=\"ascii\">3</DataArray></Strips>"
      "<Polys><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray><DataArray "
      "type=\"Int32\" Name=\"offsets\" format=\"ascii\">3</DataArray></Polys>"
      "</Piece></PolyData></VTKFile>\n";
  const Mesh mesh = read(folder.write("square.vtp", file));
  expect_square(mesh, true);
  EXPECT_EQ(mesh.format, "vtp");
}

// A triangle in an external buffer, drawn by two nodes: one moved, one turned and scaled, with a material each.
TEST(VtkReader, GltfNodesAndMaterials) {
  const TempFolder folder;
  std::string buffer;
  for (float f : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) buffer += raw(f);
  for (uint16_t i : {0, 1, 2}) buffer += raw(i);
  folder.write("ab.bin", buffer);
  const std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],
      "nodes":[{"mesh":0,"translation":[10,0,0]},{"children":[2],"scale":[2,2,2]},{"mesh":1,"rotation":[0,0,0.7071067811865476,0.7071067811865476]}],
      "materials":[{"pbrMetallicRoughness":{"baseColorFactor":[1,0,0,1]}},{"pbrMetallicRoughness":{"baseColorFactor":[0,0.2158605,1,1]}}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]},{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":1}]}],
      "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],
      "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],
      "buffers":[{"uri":"ab.bin","byteLength":42}]})";
  const Mesh mesh = read(folder.write("two.gltf", json));
  ASSERT_EQ(mesh.positions.size(), 6u);
  ASSERT_EQ(mesh.indices.size(), 6u);
  const std::vector<glm::dvec3> expected = {{10, 0, 0}, {11, 0, 0}, {10, 1, 0}, {0, 0, 0}, {0, 2, 0}, {-2, 0, 0}};
  for (int i = 0; i < 6; ++i) EXPECT_LT(glm::distance(mesh.positions[i], expected[i]), 1e-6) << i;
  EXPECT_EQ(mesh.colours, (std::vector<uint32_t>{0xff0000, 0xff0000, 0xff0000, 0x0080ff, 0x0080ff,
                                                 0x0080ff}));  // factors are linear light

  std::filesystem::remove(folder / "ab.bin");
  const auto missing = read_mesh(folder / "two.gltf", nullptr);
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().text.find("ab.bin"), std::string::npos) << missing.error().text;
}

TEST(AsciiGrids, HaveAVoidCorner) {
  const TempFolder folder;
  const auto path =
      folder.write("grid.asc",
                   "ncols 3\nnrows 2\nxllcorner 500000\nyllcorner 4000000\ncellsize 30\nNODATA_value -9999\n"
                   "1 2 3\n4 5 -9999\n");
  const auto mesh = read_mesh(path, nullptr, {.z_scale = 2});
  ASSERT_TRUE(mesh) << mesh.error().text;
  EXPECT_EQ(mesh->format, "raster");
  EXPECT_EQ(mesh->positions.size(), 5u);
  EXPECT_EQ(mesh->indices.size(), 9u);
  EXPECT_NEAR(glm::distance(mesh->positions[0], mesh->positions[1] - glm::dvec3(0, 0, 2)), 30, 1e-6);
  EXPECT_EQ(mesh->positions[4].z, 10);
  EXPECT_EQ(mesh->colours.size(), 5u);
}

TEST(AsciiGrids, ATextureIsDraped) {
  const TempFolder folder;
  const auto path = folder.write("grid.asc", "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n4 5\n");
  const auto image =
      folder.write("photo.ppm", "P6 2 2 255\n" + std::string("\xff\0\0\0\xff\0\0\0\xff\x40\x50\x60", 12));
  const auto mesh = read_mesh(path, nullptr, {.texture = image});
  ASSERT_TRUE(mesh) << mesh.error().text;
  EXPECT_EQ(mesh->colours, (std::vector<uint32_t>{0xff0000, 0x00ff00, 0x0000ff, 0x405060}));
  const auto missing = read_mesh(path, nullptr, {.texture = folder / "nothing.png"});
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().text.find("nothing.png"), std::string::npos);
  // A picture that names another one is not followed.
  const auto naming = folder.write(
      "naming.png",
      "<VRTDataset rasterXSize=\"2\" rasterYSize=\"2\"><VRTRasterBand dataType=\"Byte\" band=\"1\"><SimpleSource>"
      "<SourceFilename relativeToVRT=\"1\">photo.ppm</SourceFilename><SourceBand>1</SourceBand></SimpleSource>"
      "</VRTRasterBand></VRTDataset>");
  const auto followed = read_mesh(path, nullptr, {.texture = naming});
  ASSERT_FALSE(followed);
  EXPECT_TRUE(followed.error().text.starts_with(naming + ": cannot be read as an image")) << followed.error().text;
}

TEST(DetectFormat, ByContentBeforeName) {
  EXPECT_EQ(detect_format("ply\nformat", "x.obj").format, "ply");
  EXPECT_EQ(detect_format("OFF\n1 2 3", "x").format, "off");
  EXPECT_EQ(detect_format("# vtk DataFile Version", "x").format, "vtk");
  EXPECT_EQ(detect_format("# comment\n\nv 1 2 3\n", "no extension").format, "obj");
  EXPECT_EQ(detect_format("solid x\nfacet normal", "x").format, "stl");
  EXPECT_EQ(detect_format("{ \"asset\": {} }", "x").format, "gltf");
  EXPECT_EQ(detect_format(std::string(100, '\1'), "N42W123.hgt").format, "raster");
  EXPECT_EQ(detect_format(std::string("II*\0", 4), "x").format, "raster");
  for (const char* volume : {"scan.nii.gz", "volume.mha"}) {
    const DetectedFormat detected = detect_format(std::string(100, '\1'), volume);
    EXPECT_EQ(detected.format, "");
    EXPECT_NE(detected.complaint.find("supported are"), std::string::npos) << detected.complaint;
  }
}

}  // namespace
}  // namespace telesplat::data::test
