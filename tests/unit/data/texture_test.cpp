#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <map>
#include <random>
#include <set>

#include "common/image/file.h"
#include "services/data/mesh/reader.h"
#include "services/data/texture/bake.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

constexpr uint32_t kRed = 0xff0000, kGreen = 0x00ff00, kBlue = 0x0000ff, kYellow = 0xffff00;

// Four squares of `side` pixels: red and green above, blue and yellow below.
image::View four_colours(int side) {
  image::View out{2 * side, 2 * side, {}, {}};
  for (int y = 0; y < 2 * side; ++y)
    for (int x = 0; x < 2 * side; ++x)
      out.colour.push_back(y < side ? (x < side ? kRed : kGreen) : (x < side ? kBlue : kYellow));
  return out;
}

std::string content_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string png_of(const TempFolder& folder, const image::View& picture) {
  EXPECT_TRUE(image::write_png(folder / "made.png", picture));
  return content_of(folder / "made.png");
}

// Returns the colour of the nearest vertex.
uint32_t colour_near(const Mesh& mesh, glm::dvec3 place) {
  size_t best = 0;
  for (size_t v = 0; v < mesh.positions.size(); ++v)
    if (glm::distance(mesh.positions[v], place) < glm::distance(mesh.positions[best], place)) best = v;
  EXPECT_LT(glm::distance(mesh.positions[best], place), 0.2) << "vertices are not dense enough";
  return mesh.colours.empty() ? 0 : mesh.colours[best];
}

// Returns the rim: edges, by the positions of their ends, with one triangle; others have two. A vertex in the middle of
// a neighbour's edge would make edges with one triangle inside of the surface.
std::vector<std::pair<glm::dvec3, glm::dvec3>> rim(const Mesh& mesh) {
  const auto less = [](const glm::dvec3& a, const glm::dvec3& b) {
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
  };
  const auto pair_less = [&](const auto& a, const auto& b) {
    return less(a.first, b.first) || (!less(b.first, a.first) && less(a.second, b.second));
  };
  std::map<std::pair<glm::dvec3, glm::dvec3>, int, decltype(pair_less)> edges(pair_less);
  for (size_t t = 0; t < mesh.indices.size(); t += 3)
    for (size_t k = 0; k < 3; ++k) {
      glm::dvec3 a = mesh.positions[mesh.indices[t + k]], b = mesh.positions[mesh.indices[t + (k + 1) % 3]];
      if (less(b, a)) std::swap(a, b);
      ++edges[{a, b}];
    }
  std::vector<std::pair<glm::dvec3, glm::dvec3>> alone;
  for (const auto& [edge, triangles] : edges)
    if (triangles == 1) alone.push_back(edge);
  return alone;
}
int edges_with_one_triangle(const Mesh& mesh) { return int(rim(mesh).size()); }
double length_of_rim(const Mesh& mesh) {
  double sum = 0;
  for (const auto& [a, b] : rim(mesh)) sum += glm::distance(a, b);
  return sum;
}

double area(const Mesh& mesh) {
  double sum = 0;
  for (size_t t = 0; t < mesh.indices.size(); t += 3) {
    const auto& p = mesh.positions;
    const auto i = [&](size_t k) { return mesh.indices[t + k]; };
    sum += glm::length(glm::cross(p[i(1)] - p[i(0)], p[i(2)] - p[i(0)])) / 2;
  }
  return sum;
}

Mesh read(const std::string& path, uint64_t detail = kDefaultTextureDetail) {
  auto mesh = read_mesh(path, nullptr, {}, {}, detail);
  EXPECT_TRUE(mesh) << mesh.error().text;
  return mesh ? std::move(*mesh) : Mesh{};
}

constexpr const char* kQuadObj =
    "mtllib quad.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n"
    "usemtl painted\nf 1/1/1 2/2/1 3/3/1 4/4/1\n";

std::string quad_obj(const TempFolder& folder, const std::string& material) {
  folder.write("quad.mtl", "newmtl painted\n" + material);
  return folder.write("quad.obj", kQuadObj);
}

void expect_right_way_round(const Mesh& mesh) {
  EXPECT_EQ(colour_near(mesh, {0.2, 0.8, 0}), kRed) << "the picture's upper left";
  EXPECT_EQ(colour_near(mesh, {0.8, 0.8, 0}), kGreen) << "its upper right";
  EXPECT_EQ(colour_near(mesh, {0.2, 0.2, 0}), kBlue) << "its lower left";
  EXPECT_EQ(colour_near(mesh, {0.8, 0.2, 0}), kYellow) << "its lower right";
}

TEST(Textures, ObjsTextureLiesTheRightWayRound) {
  const TempFolder folder;
  png_of(folder, four_colours(16));
  const Mesh mesh = read(quad_obj(folder, "Kd 1 1 1\nmap_Kd made.png\n"));
  expect_right_way_round(mesh);
  EXPECT_GT(mesh.indices.size() / 3, 100u) << "divided along the borders of the colours";
  EXPECT_LT(mesh.indices.size() / 3, 4000u) << "and not where there is one colour";
  EXPECT_NEAR(area(mesh), 1, 1e-9);
  EXPECT_TRUE(mesh.notes.empty());
  for (const auto& n : mesh.normals) EXPECT_EQ(n, glm::vec3(0, 0, 1));
}

TEST(Textures, ObjsMaterialTintsItsTextureAndBlackIsNone) {
  const TempFolder folder;
  image::View white{4, 4, std::vector<uint32_t>(16, 0xffffff), {}};
  png_of(folder, white);
  EXPECT_EQ(colour_near(read(quad_obj(folder, "Kd 1 0 0.5\nmap_Kd made.png\n")), {0, 0, 0}), 0xff0080u);
  EXPECT_EQ(colour_near(read(quad_obj(folder, "Kd 0 0 0\nmap_Kd made.png\n")), {0, 0, 0}), 0xffffffu);
  EXPECT_EQ(read(quad_obj(folder, "map_Kd made.png\n")).indices.size(), 6u) << "a plain picture divides nothing";
}

TEST(Textures, ObjsOptionsAndNamesWithBlanksAreUnderstood) {
  const TempFolder folder;
  png_of(folder, four_colours(16));
  std::filesystem::create_directory(folder / "two words");
  std::filesystem::rename(folder / "made.png", folder / "two words/my picture.png");
  // Half of the picture, from its right half on.
  const Mesh mesh =
      read(quad_obj(folder, "map_Kd -blendu on -s 0.5 1 1 -o 0.5 0 0 -bm 1 two words\\my picture.png\r\n"));
  EXPECT_EQ(colour_near(mesh, {0.2, 0.8, 0}), kGreen);
  EXPECT_EQ(colour_near(mesh, {0.8, 0.8, 0}), kGreen);
  const Mesh clamped = read(quad_obj(folder, "map_Kd -clamp on -s 2 2 -o -1 0 two words/my picture.png\n"));
  EXPECT_EQ(colour_near(clamped, {0.1, 0.9, 0}), kRed) << "the picture's left rim goes on";
}

// A square of four_colours(), as MeshLab (places of corners), Blender (s t) and CloudCompare write it.
TEST(Textures, PlysPictureLiesTheRightWayRoundInEachWayToNameItsPlaces) {
  const TempFolder folder;
  folder.write("a picture.png", png_of(folder, four_colours(32)));
  const auto ply = [&](const std::string& names, const std::string& places, const std::string& face) {
    return fmt::format(
        "ply\nformat ascii 1.0\ncomment TextureFile a picture.png\nelement vertex 4\nproperty float x\nproperty float "
        "y\n"
        "property float z\n{}element face 1\nproperty list uchar int vertex_indices\n{}end_header\n{}",
        names, places, face);
  };
  const std::string by_corner = "property list uchar float texcoord\n", four = "0 0 0\n4 0 0\n4 4 0\n0 4 0\n";
  for (const std::string& file :
       {ply("", by_corner, four + "4 0 1 2 3 8 0 0 1 0 1 1 0 1\n"),
        ply("", by_corner + "property int texnumber\n", four + "4 0 1 2 3 8 0 0 1 0 1 1 0 1 0\n"),
        ply("property float s\nproperty float t\n", "", "0 0 0 0 0\n4 0 0 1 0\n4 4 0 1 1\n0 4 0 0 1\n4 0 1 2 3\n"),
        ply("property float texture_u\nproperty float texture_v\nproperty uchar red\nproperty uchar green\nproperty "
            "uchar blue\n",
            "", "0 0 0 0 0 9 9 9\n4 0 0 1 0 9 9 9\n4 4 0 1 1 9 9 9\n0 4 0 0 1 9 9 9\n4 0 1 2 3\n")}) {
    const auto mesh = read_mesh(folder.write("a.ply", file), nullptr);
    ASSERT_TRUE(mesh.ok()) << mesh.error().text;
    EXPECT_TRUE(mesh->notes.empty());
    EXPECT_EQ(colour_near(*mesh, {0.1, 3.9, 0}), kRed);
    EXPECT_EQ(colour_near(*mesh, {3.9, 3.9, 0}), kGreen);
    EXPECT_EQ(colour_near(*mesh, {0.1, 0.1, 0}), kBlue);
    EXPECT_EQ(colour_near(*mesh, {3.9, 0.1, 0}), kYellow);
  }
  EXPECT_EQ(
      companion_files("ply\nformat ascii 1.0\ncomment TextureFile a picture.png\nend_header\n", "ply", "/x/a.ply"),
      std::vector<std::string>{"/x/a picture.png"});
}

TEST(Textures, PlysFacesHaveThePictureThatTheyNumber) {
  const TempFolder folder;
  folder.write("red.png", png_of(folder, image::View{1, 1, {kRed}, {}}));
  folder.write("green.png", png_of(folder, image::View{1, 1, {kGreen}, {}}));
  const auto mesh = read_mesh(
      folder.write(
          "a.ply",
          "ply\nformat ascii 1.0\ncomment TextureFile red.png\ncomment TextureFile green.png\ncomment TextureFile "
          "missing.png\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
          "property uchar green\nproperty uchar blue\nelement face 4\nproperty list uchar int vertex_indices\n"
          "property list uchar float texcoord\nproperty int texnumber\nend_header\n"
          "0 0 0 1 2 3\n1 0 0 1 2 3\n1 1 0 1 2 3\n0 1 0 1 2 3\n3 0 1 2 6 0 0 0 0 0 0 0\n3 0 2 3 6 0 0 0 0 0 0 1\n"
          "3 0 1 3 6 0 0 0 0 0 0 2\n3 1 2 3 6 0 0 0 0 0 0 -1\n"),
      nullptr);
  ASSERT_TRUE(mesh.ok()) << mesh.error().text;
  const std::vector<uint32_t> expected{kRed, kGreen, 0x010203, 0x010203};
  for (size_t i = 0; i < 12; ++i) EXPECT_EQ(mesh->colours[mesh->indices[i]], expected[i / 3]) << i;
  ASSERT_EQ(mesh->notes.size(), 1u);
  EXPECT_NE(mesh->notes[0].find("missing.png is not there"), std::string::npos) << mesh->notes[0];
}

TEST(Textures, ObjsOptionsThatAreNotAppliedAreTold) {
  const TempFolder folder;
  folder.write("a.png", png_of(folder, four_colours(4)));
  const std::string obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n";
  for (const auto& [option, told] : {std::pair{"-mm 0 1", false},
                                     {"-mm 0.2 1", true},
                                     {"-cc on", true},
                                     {"-t 1", true},
                                     {"-blendu on -s 1 1 1", false}}) {
    folder.write("a.mtl", fmt::format("newmtl a\nmap_Kd {} a.png\n", option));
    const auto mesh = read_mesh(folder.write("a.obj", obj), nullptr);
    ASSERT_TRUE(mesh.ok()) << mesh.error().text;
    EXPECT_EQ(mesh->notes.size(), told ? 1u : 0u) << option;
  }
}

TEST(Textures, MissingPicturesLeaveTheMaterialsColourAndANote) {
  const TempFolder folder;
  const Mesh mesh = read(quad_obj(folder, "Kd 0 0 1\nmap_Kd nowhere.png\n"));
  EXPECT_EQ(mesh.colours, std::vector<uint32_t>(4, kBlue));
  ASSERT_EQ(mesh.notes.size(), 1u);
  EXPECT_NE(mesh.notes[0].find("nowhere.png"), std::string::npos);
  EXPECT_NE(mesh.notes[0].find("quad.obj"), std::string::npos);
}

TEST(Textures, DamagedPicturesAreRefusedWithTheirName) {
  const TempFolder folder;
  std::string whole = png_of(folder, four_colours(64));
  for (const std::string& bad :
       {std::string("not a picture"), whole.substr(0, whole.size() / 2), whole.substr(0, 20)}) {
    folder.write("bad.png", bad);
    const auto mesh = read_mesh(quad_obj(folder, "map_Kd bad.png\n"), nullptr);
    ASSERT_FALSE(mesh) << bad.size();
    EXPECT_NE(mesh.error().text.find("bad.png"), std::string::npos) << mesh.error().text;
    EXPECT_EQ(mesh.error().text.find('\n'), std::string::npos) << mesh.error().text;
  }
  // A header of 60000 x 60000 pixels without data behind it.
  std::string huge = whole.substr(0, 33);
  for (const size_t at : {16, 20}) huge[at] = 0, huge[at + 1] = 0, huge[at + 2] = char(0xea), huge[at + 3] = 0x60;
  folder.write("bad.png", huge);
  const auto mesh = read_mesh(quad_obj(folder, "map_Kd bad.png\n"), nullptr);
  ASSERT_FALSE(mesh);
  EXPECT_NE(mesh.error().text.find("bad.png"), std::string::npos) << mesh.error().text;
}

TEST(Textures, WrongTextureCoordinatesAreRefusedOrLeftOut) {
  const TempFolder folder;
  png_of(folder, four_colours(16));
  folder.write("quad.mtl", "newmtl painted\nKd 0 1 0\nmap_Kd made.png\n");
  const auto obj = [&](const std::string& vt, const std::string& f) {
    return folder.write("bad.obj", "mtllib quad.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\n" + vt + "usemtl painted\n" + f);
  };
  EXPECT_FALSE(read_mesh(obj("vt 0 0\n", "f 1/1 2/2 3/3\n"), nullptr));
  EXPECT_FALSE(read_mesh(obj("vt x\n", "f 1/1 2/1 3/1\n"), nullptr));
  for (const char* vt : {"vt nan 0\nvt 1e30 0\nvt inf -inf\n", "vt 1e4 1e4\nvt -1e4 0\nvt 0 0\n"}) {
    const Mesh mesh = read(obj(vt, "f 1/1 2/2 3/3\n"), 5000);
    EXPECT_LE(mesh.indices.size() / 3, 5000u);
    EXPECT_NEAR(area(mesh), 0.5, 1e-9);
  }
  EXPECT_EQ(read(obj("", "f 1 2 3\n")).colours, std::vector<uint32_t>(3, kGreen)) << "no coordinates: the material's";
}

TEST(Textures, ThePicturesContentIsPartOfTheStoresName) {
  const TempFolder folder;
  png_of(folder, four_colours(8));
  const std::string path = quad_obj(folder, "map_Kd made.png\n");
  const auto progress = [](const char*, double) {};
  const auto before = file_source(path, {}, "", kDefaultTextureDetail, progress);
  ASSERT_TRUE(before) << before.error().text;
  png_of(folder, four_colours(9));
  const auto after = file_source(path, {}, "", kDefaultTextureDetail, progress);
  EXPECT_NE(before->hash, after->hash);
  const auto coarser = file_source(path, {}, "", 1000, progress);
  EXPECT_EQ(coarser->hash, after->hash);
  EXPECT_NE(coarser->variant, after->variant);
}

// A cube of six faces, all with the same picture; positions shared or not, as the format needs them.
struct Cube {
  std::vector<glm::vec3> positions;
  std::vector<glm::vec2> uv;
  std::vector<uint16_t> indices;
};
Cube cube() {
  Cube out;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const auto first = uint16_t(out.positions.size());
      for (const auto& [u, v] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
        glm::vec3 p(0);
        p[axis] = float(side), p[(axis + 1) % 3] = float(side ? u : 1 - u), p[(axis + 2) % 3] = float(v);
        out.positions.push_back(p);
        out.uv.emplace_back(u, 1 - v);
      }
      for (const int i : {0, 1, 2, 0, 2, 3}) out.indices.push_back(uint16_t(first + i));
    }
  return out;
}

template <class T>
void append(std::string& to, const std::vector<T>& values) {
  to.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

// `image` is the JSON of images[0], `sampler` that of samplers[0]; the picture, if any, is the last bufferView.
std::string glb(const Cube& c, const std::string& png, const std::string& image, const std::string& sampler,
                const std::string& factor = "[1,1,1,1]") {
  std::string bin;
  append(bin, c.positions);
  append(bin, c.uv);
  append(bin, c.indices);
  const size_t p = c.positions.size() * 12, t = c.uv.size() * 8, i = c.indices.size() * 2;
  bin += png;
  while (bin.size() % 4) bin += '\0';
  const auto n = [](size_t v) { return std::to_string(v); };
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"indices":2,"material":0}]}],
    "materials":[{"pbrMetallicRoughness":{"baseColorFactor":)" +
      factor + R"(,"baseColorTexture":{"index":1}}}],
    "textures":[{"source":0},{"source":0,"sampler":0}],"images":[)" +
      image + R"(],"samplers":[)" + sampler + R"(],
    "accessors":[{"bufferView":0,"componentType":5126,"count":)" +
      n(c.positions.size()) + R"(,"type":"VEC3",
      "min":[0,0,0],"max":[1,1,1]},{"bufferView":1,"componentType":5126,"count":)" +
      n(c.uv.size()) + R"(,"type":"VEC2"},
      {"bufferView":2,"componentType":5123,"count":)" +
      n(c.indices.size()) + R"(,"type":"SCALAR"}],
    "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" +
      n(p) + R"(},{"buffer":0,"byteOffset":)" + n(p) + R"(,"byteLength":)" + n(t) + R"(},{"buffer":0,"byteOffset":)" +
      n(p + t) + R"(,"byteLength":)" + n(i) + R"(})" +
      (png.empty() ? "" : R"(,{"buffer":0,"byteOffset":)" + n(p + t + i) + R"(,"byteLength":)" + n(png.size()) + "}") +
      R"(],"buffers":[{"byteLength":)" + n(bin.size()) + "}]}";
  while (json.size() % 4) json += ' ';
  std::string out = "glTF";
  append(out, std::vector<uint32_t>{2, uint32_t(12 + 8 + json.size() + 8 + bin.size()), uint32_t(json.size())});
  out += "JSON" + json;
  append(out, std::vector<uint32_t>{uint32_t(bin.size()), 0x004e4942});
  return out + bin;
}

constexpr const char* kEmbedded = R"({"bufferView":3,"mimeType":"image/png"})";

// Places of the picture's squares on the cube's side towards +z (x to the right, y up).
void expect_cube_right_way_round(const Mesh& mesh) {
  // axis 2, side 1: u goes along x, v of the formula along y, and the picture's upper rim is at v = 1.
  EXPECT_EQ(colour_near(mesh, {0.25, 0.75, 1}), kRed);
  EXPECT_EQ(colour_near(mesh, {0.75, 0.75, 1}), kGreen);
  EXPECT_EQ(colour_near(mesh, {0.25, 0.25, 1}), kBlue);
  EXPECT_EQ(colour_near(mesh, {0.75, 0.25, 1}), kYellow);
}

TEST(Textures, GltfsEmbeddedTextureLiesTheRightWayRoundWithoutCracks) {
  const TempFolder folder;
  const std::string png = png_of(folder, four_colours(16));
  const Mesh mesh = read(folder.write("cube.glb", glb(cube(), png, kEmbedded, "{}")));
  expect_cube_right_way_round(mesh);
  EXPECT_GT(mesh.indices.size() / 3, 600u);
  EXPECT_EQ(edges_with_one_triangle(mesh), 0) << "the cube is closed, across seams of the texture too";
  EXPECT_NEAR(area(mesh), 6, 1e-6);
}

TEST(Textures, GltfsFactorTintsInLinearLight) {
  const TempFolder folder;
  image::View grey{2, 2, std::vector<uint32_t>(4, 0xbcbcbc), {}};  // half of the light
  const std::string png = png_of(folder, grey);
  const Mesh mesh = read(folder.write("cube.glb", glb(cube(), png, kEmbedded, "{}", "[0.5,1,0,1]")));
  for (const uint32_t c : mesh.colours) {
    EXPECT_NEAR(int(c >> 16), 0x89, 1) << "a quarter of the light";
    EXPECT_EQ(c >> 8 & 255, 0xbcu);
    EXPECT_EQ(c & 255, 0u);
  }
}

TEST(Textures, GltfWrapsAsItsSamplerSays) {
  const TempFolder folder;
  const std::string png = png_of(folder, four_colours(16));
  Cube c = cube();
  for (auto& uv : c.uv) uv = uv * 2.0f;  // the picture twice in each direction
  const auto colours = [&](const std::string& sampler) {
    const Mesh mesh = read(folder.write("cube.glb", glb(c, png, kEmbedded, sampler)));
    std::vector<uint32_t> out;
    for (const double x : {0.125, 0.375, 0.625, 0.875}) out.push_back(colour_near(mesh, {x, 0.875, 1}));
    return out;
  };
  EXPECT_EQ(colours("{}"), (std::vector<uint32_t>{kRed, kGreen, kRed, kGreen}));
  EXPECT_EQ(colours(R"({"wrapS":33648,"wrapT":33648})"), (std::vector<uint32_t>{kRed, kGreen, kGreen, kRed}));
  EXPECT_EQ(colours(R"({"wrapS":33071,"wrapT":33071})"), (std::vector<uint32_t>{kRed, kGreen, kGreen, kGreen}));
}

TEST(Textures, GltfsPictureMayLieBesideItOrInText) {
  const TempFolder folder;
  png_of(folder, four_colours(16));
  expect_cube_right_way_round(read(folder.write("cube.glb", glb(cube(), "", R"({"uri":"made.png"})", "{}"))));
  // The smallest possible PNG, one red pixel, as text.
  const std::string red =
      R"({"uri":"data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC"})";
  for (const uint32_t c : read(folder.write("red.glb", glb(cube(), "", red, "{}"))).colours) EXPECT_EQ(c, kRed);
  const Mesh without =
      read(folder.write("missing.glb", glb(cube(), "", R"({"uri":"nowhere.png"})", "{}", "[0,0,1,1]")));
  EXPECT_EQ(colour_near(without, {0, 0, 0}), kBlue);
  ASSERT_EQ(without.notes.size(), 1u);
  EXPECT_NE(without.notes[0].find("nowhere.png"), std::string::npos) << without.notes[0];
}

TEST(Textures, GltfsDamagedPicturesAreRefused) {
  const TempFolder folder;
  const std::string png = png_of(folder, four_colours(64));
  const auto refused = [&](const std::string& content) {
    const auto mesh = read_mesh(folder.write("bad.glb", content), nullptr);
    EXPECT_FALSE(mesh);
    if (mesh) return std::string();
    EXPECT_EQ(mesh.error().text.find('\n'), std::string::npos) << mesh.error().text;
    return mesh.error().text;
  };
  for (const auto& text :
       {refused(glb(cube(), png.substr(0, png.size() / 3), kEmbedded, "{}")),
        refused(glb(cube(), "no picture", kEmbedded, "{}")), refused(glb(cube(), png, R"({"bufferView":77})", "{}")),
        refused(glb(cube(), png, R"({"uri":"data:image/png;base64,!!!"})", "{}"))})
    EXPECT_NE(text.find("bad.glb"), std::string::npos) << text;
}

TEST(Textures, DetailEndsAtTheLimitAndSaysSo) {
  const TempFolder folder;
  image::View noise{256, 256, {}, {}};
  std::mt19937 random(3);
  for (int i = 0; i < 256 * 256; ++i) noise.colour.push_back(random() & 0xffffff);
  png_of(folder, noise);
  const std::string path = quad_obj(folder, "map_Kd made.png\n");
  const Mesh mesh = read(path, 2000);
  EXPECT_LE(mesh.indices.size() / 3, 2000u);
  EXPECT_GT(mesh.indices.size() / 3, 1000u) << "the limit is made use of";
  ASSERT_EQ(mesh.notes.size(), 1u);
  EXPECT_NE(mesh.notes[0].find("--texture-detail 2000"), std::string::npos) << mesh.notes[0];
  // A vertex that stands for many texels gets their mean: the noise becomes grey, by the mean of its light.
  double off = 0;
  for (const uint32_t c : mesh.colours) off += std::abs(int(c >> 8 & 255) - 0x98);
  EXPECT_LT(off / double(mesh.colours.size()), 30);
  EXPECT_GE(edges_with_one_triangle(mesh), 4 * 16) << "all rims are divided";
  EXPECT_NEAR(length_of_rim(mesh), 4, 1e-9) << "and there is no other rim";
  EXPECT_EQ(read(path, 0).indices.size(), 6u) << "0: vertices as they are";
}

TEST(Textures, AnyMeshStaysWithoutCracks) {
  // A closed surface of random triangles' sizes: a tetrahedron divided unevenly by its texture.
  std::mt19937 random(11);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int round = 0; round < 20; ++round) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    std::vector<uint32_t> faces = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
    TextureUse use;
    Mesh seams;  // every face has its own vertices, so every edge is a seam
    for (const uint32_t i : faces) {
      seams.indices.push_back(uint32_t(seams.positions.size()));
      seams.positions.push_back(mesh.positions[i]);
      use.uv.emplace_back(unit(random), unit(random));
      use.texture.push_back(round % 3 == 0 && seams.indices.size() <= 3 ? kNoTexture : 0);
    }
    image::View noise{32, 32, {}, {}};
    for (int i = 0; i < 32 * 32; ++i) noise.colour.push_back(random() & 0xffffff);
    use.textures = {std::make_shared<Texture>(noise, Wrap::kRepeat, Wrap::kRepeat, round % 2 == 0)};
    const double before = area(seams);
    bake_textures(seams, std::move(use), round % 4 == 0 ? 700 : 1'000'000);
    EXPECT_EQ(edges_with_one_triangle(seams), 0) << round;
    EXPECT_NEAR(area(seams), before, 1e-9) << round;
    EXPECT_TRUE(validate_mesh(seams, "seams"));
    EXPECT_EQ(seams.normals.size(), seams.positions.size());
  }
}

TEST(Textures, RealGlbHasItsTexture) {
  const char* home = std::getenv("HOME");
  const std::string path = std::string(home ? home : "") + "/.cache/telesplat-data/formats/space-exploration.glb";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not here";
  const Mesh mesh = read(path, 400'000);
  EXPECT_LE(mesh.indices.size() / 3, 400'000u);
  std::set<uint32_t> colours(mesh.colours.begin(), mesh.colours.end());
  EXPECT_GT(colours.size(), 8u) << "its picture is a palette";
}

TEST(Bake, TexturesOfOneColourAreNotSearched) {
  Mesh mesh;
  TextureUse use;
  const auto grey = std::make_shared<Texture>(image::View{1024, 1, std::vector<uint32_t>(1024, 0x808080), {}},
                                              Wrap::kRepeat, Wrap::kRepeat);
  EXPECT_TRUE(grey->plain());
  EXPECT_FALSE(Texture(four_colours(2), Wrap::kRepeat, Wrap::kRepeat).plain());
  use.textures = {grey};
  // Each of them repeats the texture 100 times and more: reading every texel would take seconds.
  for (uint32_t v = 0; v < 30'000; ++v) {
    mesh.positions.emplace_back(v % 3 == 1, v % 3 == 2, v / 3);
    mesh.indices.push_back(v);
    use.texture.push_back(0);
    use.uv.emplace_back(v % 3 == 1 ? 100 : 0, v % 3 == 2 ? 100 : 0);
  }
  EXPECT_EQ(bake_textures(mesh, std::move(use), 1'000'000), "");
  EXPECT_EQ(mesh.indices.size(), 30'000u);
  EXPECT_EQ(mesh.colours[29'999], 0x808080u);
}

}  // namespace
}  // namespace telesplat::data::test
