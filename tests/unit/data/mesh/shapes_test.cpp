// Shapes of mesh files from other programs: concave faces, vertices that are no numbers, unusual text.
#include <glm/geometric.hpp>

#include "services/data/mesh/reader.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

using namespace std::string_literals;

Mesh read(const std::string& path) {
  auto mesh = read_mesh(path, nullptr);
  EXPECT_TRUE(mesh.ok()) << (mesh ? "" : mesh.error().text);
  return mesh ? std::move(*mesh) : Mesh();
}

double area_of(const Mesh& mesh) {
  double sum = 0;
  for (size_t t = 0; t < mesh.indices.size(); t += 3) {
    const glm::dvec3 a = mesh.positions[mesh.indices[t]], b = mesh.positions[mesh.indices[t + 1]],
                     c = mesh.positions[mesh.indices[t + 2]];
    sum += glm::length(glm::cross(b - a, c - a)) / 2;
  }
  return sum;
}

bool covers(const Mesh& mesh, double x, double y) {
  const auto side = [&](const glm::dvec3& a, const glm::dvec3& b) {
    return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) > 0;
  };
  for (size_t t = 0; t < mesh.indices.size(); t += 3) {
    const glm::dvec3 a = mesh.positions[mesh.indices[t]], b = mesh.positions[mesh.indices[t + 1]],
                     c = mesh.positions[mesh.indices[t + 2]];
    if (side(a, b) == side(b, c) && side(b, c) == side(c, a)) return true;
  }
  return false;
}

const std::string kU = "0 0 0\n3 0 0\n3 2 0\n2 2 0\n2 0.5 0\n1 0.5 0\n1 2 0\n0 2 0\n";
const std::string kPlyVertex = "property float x\nproperty float y\nproperty float z\n";

std::string obj_vertices(std::string lines) {
  for (size_t at = 0; at != lines.npos && at < lines.size(); at = lines.find('\n', at), at += at != lines.npos)
    lines.insert(at, "v ");
  return lines;
}

TEST(ConcaveFaces, LeaveTheirNotchOpenInEachFormat) {
  const TempFolder folder;
  for (const std::string& path :
       {folder.write("u.obj", obj_vertices(kU) + "f 1 2 3 4 5 6 7 8\n"),
        folder.write("normals.obj", obj_vertices(kU) + "vn 0 0 1\nf 1//1 2//1 3//1 4//1 5//1 6//1 7//1 8//1\n"),
        folder.write("u.off", "OFF\n8 1 0\n" + kU + "8 0 1 2 3 4 5 6 7\n"),
        folder.write("u.ply", "ply\nformat ascii 1.0\nelement vertex 8\n" + kPlyVertex +
                                  "element face 1\nproperty list uchar int vertex_indices\nend_header\n" + kU +
                                  "8 0 1 2 3 4 5 6 7\n")}) {
    const Mesh mesh = read(path);
    EXPECT_EQ(mesh.indices.size(), 18u) << path;
    EXPECT_NEAR(area_of(mesh), 4.5, 1e-9) << path;
    EXPECT_FALSE(covers(mesh, 1.5, 1.2)) << path;
    EXPECT_TRUE(covers(mesh, 0.5, 1.2)) << path;
  }
}

TEST(NotFinite, TrianglesAreLeftOutAndCounted) {
  const TempFolder folder;
  const std::string three = "0 0 0\n1 0 0\n0 1 0\n", faces = "3 0 1 2\n3 0 1 3\n3 1 2 4\n";
  for (const std::string bad : {"nan", "inf", "-nan", "1e999", "1.#QNAN", "-1.#IND"}) {
    const std::string five = three + bad + " 0 0\n0 0 " + bad + "\n";
    for (const std::string& path :
         {folder.write("a.ply", "ply\nformat ascii 1.0\nelement vertex 5\n" + kPlyVertex +
                                    "element face 3\nproperty list uchar int vertex_indices\nproperty float part\n"
                                    "end_header\n" +
                                    five + "3 0 1 3 1\n3 0 1 2 2\n3 1 2 4 3\n"),
          folder.write("a.off", "OFF\n5 3 0\n" + five + faces),
          folder.write("a.obj", obj_vertices(five) + "f 1 2 3\nf 1 2 4\nf 2 3 5\n")}) {
      const Mesh mesh = read(path);
      EXPECT_EQ(mesh.indices, (std::vector<uint32_t>{0, 1, 2})) << path << bad;
      ASSERT_EQ(mesh.notes.size(), 1u) << path << bad;
      EXPECT_NE(mesh.notes[0].find("2 of 3 triangles are left out"), std::string::npos) << mesh.notes[0];
    }
    const auto part = read_mesh(folder / "a.ply", nullptr, {}, "part");
    ASSERT_TRUE(part.ok());
    EXPECT_EQ(part->scalars, std::vector<float>{2});
  }
}

TEST(NotFinite, UnusedVerticesAreNoMatter) {
  const TempFolder folder;
  const std::string path = folder.write("a.off", "OFF\n4 1 0\nnan nan nan\n0 0 0\n1 0 0\n0 1 0\n3 1 2 3\n");
  EXPECT_TRUE(read(path).notes.empty());
  const auto store = open_mesh(path, plain_options("auto"), nullptr);
  ASSERT_TRUE(store.ok()) << store.error().text;
}

TEST(PlyReader, TakesFacesBeforeVerticesWideIndicesAndOldLineEnds) {
  const TempFolder folder;
  const std::string faces = "element face 1\nproperty list uint8 uint64 vertex_index\n",
                    vertices = "element vertex 8\n" + kPlyVertex;
  std::string first = "ply\r\nformat binary_little_endian 1.0\r\nobj_info made by a test\r\n" + faces + vertices +
                      "end_header\r\n" + raw(uint8_t{8});
  for (uint64_t i = 0; i < 8; ++i) first += raw(i);
  for (const float x : {0., 0., 0., 3., 0., 0., 3., 2., 0., 2., 2., 0., 2., .5, 0., 1., .5, 0., 1., 2., 0., 0., 2., 0.})
    first += raw(x);
  std::string old = "ply\nformat ascii 1.0\n" + vertices + faces + "end_header\n";
  std::replace(old.begin(), old.end(), '\n', '\r');
  for (const std::string& path :
       {folder.write("first.ply", first), folder.write("old.ply", old + kU + "8 0 1 2 3 4 5 6 7\n")}) {
    const Mesh mesh = read(path);
    EXPECT_EQ(mesh.indices.size(), 18u) << path;
    EXPECT_NEAR(area_of(mesh), 4.5, 1e-9) << path;
  }
}

TEST(ObjReader, ContinuesLinesAndLeavesOthersOutWithANote) {
  const TempFolder folder;
  const Mesh mesh = read(folder.write("a.obj",
                                      "\xef\xbb\xbf# with a byte order mark\nv 0 0 \\\n0\nv 3 0 0\\\r\n\nv 3 2 \\\r\n "
                                      "0 # corner\nv 0 2 0\nvn 0 \\\n0 1\n"
                                      "f 1//1 2//1\\\n 3//1 \\\n\\\n4//1\nl 1 2 \\\n3\np 1\n"));
  EXPECT_EQ(mesh.indices, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3}));
  EXPECT_NEAR(area_of(mesh), 6, 1e-9);
  ASSERT_EQ(mesh.notes.size(), 1u);
  EXPECT_NE(mesh.notes[0].find("its 2 lines, points, curves and surfaces are left out"), std::string::npos);
}

TEST(ObjReader, TellsOfLibrariesThatAreNotThereAndReadsSeveralOfALine) {
  const TempFolder folder;
  const std::string faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
  const Mesh missing = read(folder.write("missing.obj", "mtllib nowhere.mtl\n" + faces));
  ASSERT_EQ(missing.notes.size(), 1u);
  EXPECT_NE(missing.notes[0].find("the material library nowhere.mtl is not there"), std::string::npos);
  folder.write("a.mtl", "newmtl blue\nKd 0 0 1\n");
  folder.write("b.mtl", "newmtl red\nKd 1 0 0\n");
  folder.write("with a blank.mtl", "newmtl red\nKd 1 0 0\n");
  for (const char* names : {"a.mtl b.mtl", "with a blank.mtl"}) {
    const Mesh mesh = read(folder.write("a.obj", "  mtllib "s + names + "\n" + faces));
    EXPECT_TRUE(mesh.notes.empty()) << names;
    EXPECT_EQ(mesh.colours, std::vector<uint32_t>(3, 0xff0000)) << names;
  }
}

TEST(ObjReader, EndsOnManyNormalsOfOneVertex) {
  std::string file = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  for (int i = 1; i <= 200'000; ++i) file += fmt::format("vn 0 {} 1\nf 1//{} 2 3\n", i, i);
  const TempFolder folder;
  EXPECT_EQ(read(folder.write("a.obj", file)).indices.size(), 600'000u);
}

TEST(StlReader, TellsTextFromBinaryByParsing) {
  const TempFolder folder;
  const std::string facet =
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  std::string capitals = "solid a\n" + facet + "endsolid a\n", blanks;
  for (const char c : capitals) blanks += c == '\n' ? "\r\n\t  " : std::string(1, c);
  std::transform(capitals.begin(), capitals.end(), capitals.begin(), [](unsigned char c) { return std::toupper(c); });
  for (const std::string& text :
       {" solid a\n" + facet + "endsolid a\n", "\xef\xbb\xbfsolid\n" + facet + "endsolid\n",
        "\n\nSolid a b\n" + facet + "EndSolid\n", "solid a\nby a program\n" + facet + "endsolid a\n", capitals, blanks})
    for (const char* name : {"a.stl", "without-ending"})
      EXPECT_EQ(read(folder.write(name, text)).indices.size(), 3u) << text;

  // The header begins like text; the sizes fit, or bytes follow.
  std::string binary = "solid a\nfacet normal" + std::string(60, ' ') + raw(uint32_t{1}) + std::string(12, '\0');
  for (const float x : {0, 0, 0, 1, 0, 0, 0, 1, 0}) binary += raw(x);
  binary += std::string(2, '\0');
  EXPECT_EQ(read(folder.write("binary.stl", binary)).indices.size(), 3u);
  binary.replace(0, 20, "solid made by a tool");
  EXPECT_EQ(read(folder.write("followed.stl", binary + "more")).indices.size(), 3u);
}

}  // namespace
}  // namespace telesplat::data::test
