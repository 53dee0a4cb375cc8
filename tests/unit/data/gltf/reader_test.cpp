// Numbers, colours and scenes of glTF files.
#include "services/data/gltf/reader.h"

#include "common/image/file.h"
#include "services/data/gltf/container.h"
#include "tests/support/files/data_files.h"
#include "tests/unit/data/gltf/made.h"

namespace telesplat::data::test {
namespace {

template <class T>
class GltfNumbers : public testing::Test {};
using Integers = testing::Types<int8_t, uint8_t, int16_t, uint16_t>;
TYPED_TEST_SUITE(GltfNumbers, Integers);

// KHR_mesh_quantization: the node's transform scales the integers back.
TYPED_TEST(GltfNumbers, PositionsAreAsTheyAreStored) {
  std::vector<TypeParam> corners(kTetrahedron.begin(), kTetrahedron.end());
  for (auto& c : corners) c = TypeParam(c * 100);
  MadeGltf made;
  made.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  const size_t faces = made.accessor(kFaces, 1);
  made.show({{"attributes", {{"POSITION", made.accessor(corners, 3)}}}, {"indices", faces}},
            {{"scale", {0.01, 0.02, 0.03}}, {"translation", {1, 0, 0}}});
  expect_box(read(made.glb()), 4, {1, 0, 0}, {2, 2, 3});
}

TYPED_TEST(GltfNumbers, NormalisedPositionsReachOne) {
  std::vector<TypeParam> corners(kTetrahedron.begin(), kTetrahedron.end());
  for (auto& c : corners) c = TypeParam(c * std::numeric_limits<TypeParam>::max());
  MadeGltf made;
  const size_t faces = made.accessor(kFaces, 1);
  made.show({{"attributes", {{"POSITION", made.accessor(corners, 3, {{"normalized", true}})}}}, {"indices", faces}});
  expect_box(read(made.glb()), 4, {0, 0, 0}, {1, 1, 1});
}

TEST(Gltf, StridesAndOffsetsAreFollowed) {
  std::vector<float> mixed{-9};  // a number, then positions and normals in turns
  for (size_t v = 0; v < 4; ++v) {
    mixed.insert(mixed.end(), &kTetrahedron[3 * v], &kTetrahedron[3 * v] + 3);
    mixed.insert(mixed.end(), {0, 0, float(v + 1)});
  }
  MadeGltf made;
  const size_t view = made.view(bytes_of(mixed), {{"byteStride", 24}}), faces = made.accessor(kFaces, 1);
  const size_t p = made.bare_accessor(5126, 4, 3, {{"bufferView", view}, {"byteOffset", 4}});
  const size_t n = made.bare_accessor(5126, 4, 3, {{"bufferView", view}, {"byteOffset", 16}});
  made.show({{"attributes", {{"POSITION", p}, {"NORMAL", n}}}, {"indices", faces}});
  const Mesh mesh = read(made.glb());
  expect_box(mesh, 4, {0, 0, 0}, {1, 1, 1});
  EXPECT_EQ(mesh.normals, std::vector<glm::vec3>(4, {0, 0, 1}));
  made.json["accessors"][n]["byteOffset"] = 20;
  EXPECT_NE(refusal(made.glb()).find("exceed"), std::string::npos);
}

TEST(Gltf, SparsePositionsWithAndWithoutView) {
  const std::vector<float> moved{3, 0, 0, 3, 2, 0, 0, 2, 0};
  for (const bool with_view : {false, true}) {
    MadeGltf made;
    const Json sparse = {
        {"count", 3},
        {"indices", {{"bufferView", made.view(bytes_of<uint16_t>({1, 2, 3}))}, {"componentType", 5123}}},
        {"values", {{"bufferView", made.view(bytes_of(moved))}}}};
    const size_t p = with_view ? made.accessor(std::vector<float>(12, 0.5f), 3, {{"sparse", sparse}})
                               : made.bare_accessor(5126, 4, 3, {{"sparse", sparse}});
    made.show({{"attributes", {{"POSITION", p}}}, {"indices", made.accessor<uint8_t>({0, 1, 2, 0, 2, 3}, 1)}});
    const double first = with_view ? 0.5 : 0;
    const Mesh mesh = read(made.glb());
    expect_box(mesh, 2, {0, 0, 0}, {3, 2, first});
    EXPECT_LT(glm::distance(mesh.positions[0], glm::dvec3(first)), 1e-9);
    made.json["accessors"][p]["sparse"]["indices"]["componentType"] = 5125;
    EXPECT_FALSE(refusal(made.glb()).empty()) << "six bytes are no three numbers of four";
  }
}

TEST(Gltf, StripsFansAndListsWithoutIndicesTurnAlike) {
  const std::vector<float> zigzag{0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, 2, 0, 0},
      round{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
  MadeGltf made;
  made.show({{"attributes", {{"POSITION", made.accessor(zigzag, 3)}}}, {"mode", 5}}, {{"rotation", {1, 0, 0, 0}}});
  made.show({{"attributes", {{"POSITION", made.accessor(round, 3)}}}, {"mode", 6}}, {{"translation", {5, 0, 0}}});
  made.show({{"attributes", {{"POSITION", made.accessor<float>({9, 0, 0, 10, 0, 0, 9, 1, 0}, 3)}}}});
  made.show({{"attributes", {{"POSITION", made.accessor(zigzag, 3)}}}, {"mode", 1}});
  const Mesh mesh = read(made.glb());
  EXPECT_EQ(mesh.indices.size(), 3u * (3 + 2 + 1));
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {
    const auto at = [&](size_t k) { return mesh.positions[mesh.indices[i + k]]; };
    EXPECT_GT(glm::cross(at(1) - at(0), at(2) - at(0)).z, 0.5) << i / 3;
  }
  EXPECT_EQ(mesh.notes, std::vector<std::string>{"a.glb: parts of points or lines are left out: 1"});
}

// A corner that stands twice in a strip joins two strips.
TEST(Gltf, StripsMayBeJoined) {
  MadeGltf made;
  const size_t p = made.accessor<float>({0, 0, 0, 0, 1, 0, 1, 0, 0, 5, 0, 0, 5, 1, 0, 6, 0, 0}, 3);
  const size_t i = made.accessor<uint8_t>({0, 1, 2, 2, 3, 3, 4, 5}, 1);
  made.show({{"attributes", {{"POSITION", p}}}, {"indices", i}, {"mode", 5}});
  EXPECT_EQ(read(made.glb()).indices.size(), 6u);
}

template <class T>
MadeGltf coloured(const std::vector<T>& values, int width, const Json& material = Json::object(), MadeGltf made = {}) {
  const size_t colours = made.accessor(values, width, {{"normalized", !std::is_floating_point_v<T>}});
  const size_t p = made.accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, 3);
  made.show({{"attributes", {{"POSITION", p}, {"COLOR_0", colours}}}, {"material", made.add("materials", material)}});
  return made;
}

// Blender writes normalised ushort or float; all are linear light.
TEST(Gltf, ColoursOfAllTypesAreLinear) {
  const std::vector<uint32_t> right{0xff0000, 0x00ff00, 0xbcbcbc};
  const std::vector<uint8_t> bytes{255, 0, 0, 255, 0, 255, 0, 255, 128, 128, 128, 255};
  const std::vector<uint16_t> shorts{65535, 0, 0, 0, 65535, 0, 32768, 32768, 32768};
  const std::vector<float> floats{1, 0, 0, 1, 0, 1, 0, 1, 0.5, 0.5, 0.5, 1};
  EXPECT_EQ(read(coloured(bytes, 4).glb()).colours, right);
  EXPECT_EQ(read(coloured(shorts, 3).glb()).colours, right);
  EXPECT_EQ(read(coloured(floats, 4).glb()).colours, right);
  const Json half = {{"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.5, 1, 1}}}}};
  const Json gloss = {{"extensions", {{"KHR_materials_pbrSpecularGlossiness", {{"diffuseFactor", {0.5, 0, 1, 1}}}}}}};
  EXPECT_EQ(read(coloured(floats, 4, half).glb()).colours[0], 0xbc0000u);
  EXPECT_EQ(read(coloured(floats, 4, gloss).glb()).colours[0], 0xbc0000u);
  Json lamp = {{"emissiveFactor", {0.5, 0, 0}}, {"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}}}};
  EXPECT_EQ(read(coloured(floats, 4, lamp).glb()).colours[0], 0xbc0000u) << "a lamp is not black";
  MadeGltf silent = coloured(bytes, 4);
  silent.json["accessors"][0].erase("normalized");
  EXPECT_EQ(read(silent.glb()).colours, right);
}

TEST(Gltf, WhatIsTransparentIsLeftOutOrTold) {
  const std::vector<float> clear{1, 0, 0, 0.2, 0, 1, 0, 0.2, 0, 0, 1, 0.2};
  const auto with = [&](const Json& material) {
    MadeGltf made;
    made.show({{"attributes", {{"POSITION", made.accessor(kTetrahedron, 3)}}}, {"indices", made.accessor(kFaces, 1)}});
    return read(coloured(clear, 4, material, made).glb());
  };
  EXPECT_EQ(with({{"alphaMode", "OPAQUE"}}).indices.size(), 15u);
  EXPECT_TRUE(with({{"alphaMode", "OPAQUE"}}).notes.empty());
  const Mesh cut = with({{"alphaMode", "MASK"}});
  EXPECT_EQ(cut.indices.size(), 12u);
  EXPECT_EQ(cut.notes, std::vector<std::string>{"a.glb: triangles that are fully transparent are left out: 1"});
  EXPECT_EQ(with({{"alphaMode", "MASK"}, {"alphaCutoff", 0.1}}).indices.size(), 15u);
  const Mesh blend = with({{"alphaMode", "BLEND"}});
  EXPECT_EQ(blend.indices.size(), 15u);
  EXPECT_EQ(blend.notes, std::vector<std::string>{"a.glb: translucent parts are shown opaque: 1"});
  const Json gone = {{"alphaMode", "BLEND"}, {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0}}}}};
  EXPECT_EQ(with(gone).indices.size(), 12u);
}

// A quad reads four colours through a transform of its coordinates: offset, scale, turn, and another set.
TEST(Gltf, TextureTransformsAreApplied) {
  const TempFolder folder;
  image::View four{16, 16, {}, {}};
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x)
      four.colour.push_back(y < 8 ? (x < 8 ? 0xff0000 : 0x00ff00) : (x < 8 ? 0x0000ff : 0xffff00));
  ASSERT_TRUE(image::write_png(folder / "four.png", four));
  std::ifstream in(folder / "four.png", std::ios::binary);
  const std::string png{std::istreambuf_iterator<char>(in), {}};
  // Three corners within a sixteenth of the texture's place (u, v).
  const auto colour = [&](double u, double v, const Json& transform) {
    MadeGltf made;
    const auto uv = [&](double x, double y) {
      std::vector<uint16_t> out;
      for (const auto& [a, b] : {std::pair{0.0, 0.0}, {0.03, 0.0}, {0.0, 0.03}})
        out.insert(out.end(), {uint16_t((x + a) * 1000), uint16_t((y + b) * 1000)});
      return made.accessor(out, 2);
    };
    const size_t set = uv(u, v), other = uv(0.75, 0.25), p = made.accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, 3);
    Json whole = transform;
    if (!whole.contains("scale")) whole["scale"] = {0.001, 0.001};
    const size_t image = made.add("images", {{"bufferView", made.view(png)}, {"mimeType", "image/png"}});
    const Json info = {{"index", made.add("textures", {{"source", image}})},
                       {"extensions", {{"KHR_texture_transform", whole}}}};
    const size_t material = made.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", info}}}});
    made.show({{"attributes", {{"POSITION", p}, {"TEXCOORD_0", set}, {"TEXCOORD_1", other}}}, {"material", material}});
    return read(made.glb()).colours.at(0);
  };
  EXPECT_EQ(colour(0.2, 0.2, Json::object()), 0xff0000u);
  EXPECT_EQ(colour(0.2, 0.2, {{"offset", {0.5, 0.0}}}), 0x00ff00u);
  EXPECT_EQ(colour(0.2, 0.2, {{"offset", {0.0, 0.5}}}), 0x0000ffu);
  EXPECT_EQ(colour(0.2, 0.2, {{"texCoord", 1}}), 0x00ff00u);
  EXPECT_EQ(colour(0.4, 0.4, {{"scale", {0.0017, 0.0017}}}), 0xffff00u);
  // A quarter turn anticlockwise: (u, v) becomes (v, -u), which repeats at (v, 1 - u).
  EXPECT_EQ(colour(0.2, 0.2, {{"rotation", M_PI / 2}}), 0x0000ffu);
  EXPECT_EQ(colour(0.7, 0.2, {{"rotation", M_PI / 2}}), 0xff0000u);
}

TEST(Gltf, UnreadPicturesAreTold) {
  MadeGltf made;
  const size_t texture = made.add("textures", {{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}});
  made.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}}};
  const size_t p = made.accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, 3),
               uv = made.accessor<float>({0, 0, 1, 0, 0, 1}, 2);
  made.show({{"attributes", {{"POSITION", p}, {"TEXCOORD_0", uv}}}, {"material", 0}});
  const Mesh mesh = read(made.glb());
  ASSERT_EQ(mesh.notes.size(), 1u);
  EXPECT_NE(mesh.notes[0].find("KHR_texture_basisu"), std::string::npos) << mesh.notes[0];
  made.json["extensionsRequired"] = {"KHR_texture_basisu"};
  EXPECT_EQ(refusal(made.glb()),
            "a.glb: requires the glTF extension KHR_texture_basisu, which is not read; save the file without it");
}

TEST(Gltf, HarmlessExtensionsMayBeRequiredAndOthersAreNamed) {
  MadeGltf made;
  made.show({{"attributes", {{"POSITION", made.accessor(kTetrahedron, 3)}}}, {"indices", made.accessor(kFaces, 1)}});
  made.json["extensionsRequired"] = {"KHR_materials_unlit", "KHR_lights_punctual", "KHR_texture_transform"};
  EXPECT_EQ(read(made.glb()).indices.size(), 12u);
  made.json["extensionsRequired"].push_back("ACME_shapes");
  EXPECT_NE(refusal(made.glb()).find("extension ACME_shapes"), std::string::npos);
}

// The content decides, not the name.
TEST(Gltf, IsToldByContent) {
  EXPECT_TRUE(looks_like_gltf(MadeGltf().glb()));
  EXPECT_TRUE(looks_like_gltf("\xef\xbb\xbf \r\n{\"scenes\": [], \"asset\": {}}"));
  EXPECT_FALSE(looks_like_gltf("{\"name\": \"a\"}"));
  EXPECT_FALSE(looks_like_gltf("asset"));
}

TEST(Gltf, NamesOfFilesArePercentEncoded) {
  MadeGltf made;
  made.show({{"attributes", {{"POSITION", made.accessor(kTetrahedron, 3)}}}, {"indices", made.accessor(kFaces, 1)}});
  Folder folder;
  const auto triangles = [&](const std::string& uri) {
    made.json["buffers"] = {{{"uri", uri}, {"byteLength", made.bin.size()}}};
    const auto mesh = read_gltf(made.json.dump(), "a.gltf", folder, 0);
    return mesh ? fmt::format("{}", mesh->indices.size() / 3) : mesh.error().text;
  };
  folder.files = {{"two words.bin", made.bin}, {"100%25.bin", made.bin}, {"sub/\xc3\xa4.bin", made.bin}};
  EXPECT_EQ(triangles("two%20words.bin"), "4");
  EXPECT_EQ(triangles("two words.bin"), "4");
  EXPECT_EQ(triangles("100%25.bin"), "4") << "as it stands, where there is no 100%.bin";
  EXPECT_EQ(triangles("sub%5C%C3%a4.bin"),
            "a.gltf: primitive 0 of mesh 0: needs a file that is missing: buffer 0: "
            "sub\\\xc3\xa4.bin is not there");
  EXPECT_EQ(triangles("sub\\%C3%a4.bin"), "4");
  EXPECT_EQ(uri_file("%zz%4"), "%zz%4");
}

// Any beginning of a file, and any change of a single byte, is refused or read.
TEST(Gltf, DamageIsRefusedOrRead) {
  const std::string whole = coloured(std::vector<uint8_t>{9, 9, 9, 8, 8, 8, 7, 7, 7}, 3).glb();
  Folder nothing;
  for (size_t length = 0; length < whole.size(); ++length)
    EXPECT_FALSE(read_gltf(std::string(whole, 0, length), "cut", nothing, 0)) << length;
  size_t refused = 0;
  for (size_t at = 0; at < whole.size(); ++at)
    for (const char byte : {'\0', '9', '-', '"', '\xff'}) {
      std::string changed = whole;
      changed[at] = byte;
      const auto mesh = read_gltf(changed, "changed", nothing, 0);
      if (mesh) (void)validate_mesh(*mesh, "changed");
      refused += !mesh;
    }
  EXPECT_GT(refused, whole.size());
}

TEST(Gltf, DeepJsonIsNoHarm) {
  const std::string deep(1'000'000, '[');
  EXPECT_NE(refusal("{\"asset\":{\"version\":\"2.0\"},\"extras\":" + deep).find("damaged"), std::string::npos);
  MadeGltf made;
  made.show({{"attributes", {{"POSITION", made.accessor(kTetrahedron, 3)}}}, {"indices", made.accessor(kFaces, 1)}});
  std::string text = made.json.dump();
  text.insert(1, "\"extras\":" + deep + std::string(deep.size(), ']') + ",");
  EXPECT_NE(refusal(text).find("buffer 0"), std::string::npos) << "its buffer has no URI";
}

}  // namespace
}  // namespace telesplat::data::test
