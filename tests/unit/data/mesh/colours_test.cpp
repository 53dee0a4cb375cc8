// Colours of vertices and faces, in each way that programs write them.
#include <map>

#include "services/data/mesh/reader.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

Mesh read(const std::string& path) {
  auto mesh = read_mesh(path, nullptr);
  EXPECT_TRUE(mesh.ok()) << (mesh ? "" : mesh.error().text);
  return mesh ? std::move(*mesh) : Mesh();
}

// Returns the colour of a triangle, whose corners must have the same one.
uint32_t colour_of(const Mesh& mesh, size_t triangle) {
  if (mesh.colours.empty()) return kNoColour;
  const uint32_t colour = mesh.colours[mesh.indices.at(3 * triangle)];
  for (size_t k = 1; k < 3; ++k) EXPECT_EQ(mesh.colours[mesh.indices[3 * triangle + k]], colour);
  return colour;
}

std::string ply_with_faces(const std::string& face_properties, const std::string& faces, size_t count = 2) {
  return fmt::format(
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element face {}\n{}end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n{}",
      count, face_properties, faces);
}

TEST(FaceColours, OfPlyAreReadWhateverTheirTypesAndOrder) {
  const TempFolder folder;
  const std::string list = "property list uchar int vertex_indices\n";
  const auto rgb = [](const std::string& type) {
    return fmt::format("property {0} red\nproperty {0} green\nproperty {0} blue\n", type);
  };
  const auto expect = [&](const std::string& name, const std::string& file) {
    const Mesh mesh = read(folder.write(name, file));
    EXPECT_EQ(colour_of(mesh, 0), 0xdc1e1eu) << name;
    EXPECT_EQ(colour_of(mesh, 1), 0x1ec81eu) << name;
    EXPECT_EQ(mesh.positions.size(), 6u) << name;
  };
  expect("bytes.ply", ply_with_faces(list + rgb("uchar") + "property uchar alpha\n",
                                     "3 0 1 2 220 30 30 255\n3 0 2 3 30 200 30 255\n"));
  expect("before.ply", ply_with_faces(rgb("uchar") + list, "220 30 30 3 0 1 2\n30 200 30 3 0 2 3\n"));
  expect("shorts.ply", ply_with_faces(list + rgb("ushort"), "3 0 1 2 56540 7710 7710\n3 0 2 3 7710 51400 7710\n"));
  expect("fractions.ply",
         ply_with_faces(list + rgb("float"), "3 0 1 2 .8627 .1176 .1176\n3 0 2 3 .1176 .7843 .1176\n"));
  expect("floats.ply", ply_with_faces(list + rgb("float"), "3 0 1 2 220 30 30\n3 0 2 3 30 200 30\n"));
}

TEST(FaceColours, OfPlyColourAllTrianglesOfAPolygonAndNoneOfAnArray) {
  const TempFolder folder;
  const std::string file = ply_with_faces(
      "property list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property float heat\n",
      "4 0 1 2 3 220 30 30 7\n", 1);
  const Mesh mesh = read(folder.write("quad.ply", file));
  EXPECT_EQ(mesh.positions.size(), 4u);
  EXPECT_EQ(colour_of(mesh, 0), 0xdc1e1eu);
  EXPECT_EQ(colour_of(mesh, 1), 0xdc1e1eu);
  ASSERT_EQ(mesh.arrays.size(), 1u);
  EXPECT_EQ(mesh.arrays[0].name, "heat");
  const auto heat = read_mesh(folder / "quad.ply", nullptr, {}, "heat");
  ASSERT_TRUE(heat.ok());
  EXPECT_EQ(heat->scalars, (std::vector<float>(2, 0))) << "from the array's own origin, which is 7";
}

std::string stl(const std::string& header, const std::vector<uint16_t>& bits) {
  std::string file = header + std::string(80 - header.size(), ' ') + raw(uint32_t(bits.size()));
  for (size_t t = 0; t < bits.size(); ++t) {
    file += std::string(12, '\0');
    for (const float x : {0.f, 0.f, float(t), 1.f, 0.f, float(t), 0.f, 1.f, float(t)}) file += raw(x);
    file += raw(bits[t]);
  }
  return file;
}

TEST(FaceColours, OfStlAreThoseOfVisCamMaterialiseOrMeshLab) {
  const TempFolder folder;
  // Five bits a channel: 27, 4 and 24 of 31 are 222, 33 and 197 of 255.
  const uint16_t viscam_red = 0x8000 | 27 << 10 | 4 << 5 | 4, magics_red = 27 | 4 << 5 | 4 << 10;
  const Mesh viscam = read(folder.write("viscam.stl", stl("made by a test", {viscam_red, 0x8000 | 24 << 5, 27 << 10})));
  EXPECT_EQ(colour_of(viscam, 0), 0xde2121u);
  EXPECT_EQ(colour_of(viscam, 1), 0x00c500u);
  EXPECT_EQ(colour_of(viscam, 2), kNeutralAlbedo);  // bit 15 is clear: no colour
  const std::string header = std::string("x COLOR=\x01\x02\x03\xff,MATERIAL=");
  const Mesh magics = read(folder.write("magics.stl", stl(header, {magics_red, 24 << 5, 0x8000 | 31})));
  EXPECT_EQ(colour_of(magics, 0), 0xde2121u);
  EXPECT_EQ(colour_of(magics, 1), 0x00c500u);
  EXPECT_EQ(colour_of(magics, 2), 0x010203u);  // bit 15 is set: the colour of the whole file
  EXPECT_EQ(colour_of(read(folder.write("all.stl", stl(header, {0, 0}))), 1), 0x010203u);
  const std::string meshlab = "COLOR=\x7f\x7f\x7f MATERIAL=\x7f\x7f\x7f \x7f\x7f\x7f \x7f\x7f\x7f ";
  EXPECT_EQ(colour_of(read(folder.write("meshlab.stl", stl(meshlab, {0x8c7b}))), 0), 0xde1919u);
  EXPECT_TRUE(read(folder.write("plain.stl", stl(meshlab, {0, 0}))).colours.empty());
  EXPECT_TRUE(read(folder.write("none.stl", stl("made by a test", {0, 7, 9}))).colours.empty());
}

TEST(FaceColours, OfOffAreWholeNumbersOrFractions) {
  const TempFolder folder;
  const auto off = [&](const std::string& name, const std::string& a, const std::string& b) {
    return read(folder.write(name, "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 " + a + "\n3 0 2 3 " + b + "\n"));
  };
  const Mesh mixed = off("mixed.off", "220 30 30", "0.1 0.2 0.3 0.5 # blue");
  EXPECT_EQ(colour_of(mixed, 0), 0xdc1e1eu);
  EXPECT_EQ(colour_of(mixed, 1), 0x1a334du);
  const Mesh fractions = off("fractions.off", "1 0 0", "");
  EXPECT_EQ(colour_of(fractions, 0), 0xff0000u);
  EXPECT_EQ(colour_of(fractions, 1), kNeutralAlbedo);
  EXPECT_EQ(colour_of(off("numbers.off", "1 0 0", "0 255 0"), 0), 0x010000u);
  const Mesh map = off("map.off", "3", "");
  EXPECT_TRUE(map.colours.empty());
  ASSERT_EQ(map.notes.size(), 1u);
  EXPECT_NE(map.notes[0].find("1 faces name their colours in a colour map"), std::string::npos) << map.notes[0];
}

TEST(Colours, AboveOneMeanZeroTo255ForAll) {
  const TempFolder folder;
  const Mesh obj = read(folder.write("a.obj", "v 0 0 0 128 128 128\nv 1 0 0 1 0 0\nv 0 1 0 0 0 255 1\nf 1 2 3\n"));
  EXPECT_EQ(obj.colours, (std::vector<uint32_t>{0x808080, 0x010000, 0x0000ff}));
  const auto ply = [&](const std::string& type, const std::string& colours) {
    return read(folder.write("a.ply", fmt::format("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty "
                                                  "float y\nproperty float z\nproperty {0} red\nproperty {0} green\n"
                                                  "property {0} blue\nelement face 1\nproperty list uchar int "
                                                  "vertex_indices\nend_header\n{1}3 0 1 2\n",
                                                  type, colours)))
        .colours;
  };
  for (const char* type : {"float", "double", "int", "uint", "ushort", "uchar"})
    EXPECT_EQ(ply(type, "0 0 0 128 128 128\n1 0 0 1 0 0\n0 1 0 0 0 255\n"),
              (std::vector<uint32_t>{0x808080, 0x010000, 0x0000ff}))
        << type;
  for (const char* type : {"float", "int", "ushort"})
    EXPECT_EQ(ply(type, "0 0 0 32896 32896 32896\n1 0 0 257 0 0\n0 1 0 0 0 65535\n"),
              (std::vector<uint32_t>{0x808080, 0x010000, 0x0000ff}))
        << type;
  EXPECT_EQ(ply("uchar", "0 0 0 1 1 1\n1 0 0 1 0 0\n0 1 0 0 0 1\n")[0], 0x010101u);
}

TEST(Colours, OfSomeVerticesOfAnObjStayWithThem) {
  const TempFolder folder;
  const Mesh mesh = read(folder.write("a.obj", "v 0 0 0\nv 1 0 0 1 0 0\nv 0 1 0\nv 1 1 0 0 0 1\nf 1 2 3\nf 2 4 3\n"));
  std::map<std::pair<double, double>, uint32_t> at;
  for (size_t v = 0; v < mesh.positions.size(); ++v)
    at[{mesh.positions[v].x, mesh.positions[v].y}] = mesh.colours.at(v);
  EXPECT_EQ((at[{0, 0}]), kNeutralAlbedo);
  EXPECT_EQ((at[{1, 0}]), 0xff0000u);
  EXPECT_EQ((at[{0, 1}]), kNeutralAlbedo);
  EXPECT_EQ((at[{1, 1}]), 0x0000ffu);
}

}  // namespace
}  // namespace telesplat::data::test
