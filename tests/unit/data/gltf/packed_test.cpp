// glTF files with data packed by meshoptimizer and Draco.
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <meshoptimizer.h>

#include "tests/unit/data/gltf/made.h"

namespace telesplat::data::test {
namespace {

// A grid of 5 x 4 places: positions (1000 x, 1000 y, 256 x y), four numbers each.
std::vector<uint16_t> grid_positions() {
  std::vector<uint16_t> out;
  for (int i = 0; i < 20; ++i)
    out.insert(out.end(), {uint16_t(i % 5 * 1000), uint16_t(i / 5 * 1000), uint16_t(i % 5 * (i / 5) * 256), 0});
  return out;
}
std::vector<uint32_t> grid_faces() {
  std::vector<uint32_t> out;
  for (uint32_t y = 0; y < 3; ++y)
    for (uint32_t x = 0; x < 4; ++x) {
      const uint32_t a = 5 * y + x;
      out.insert(out.end(), {a, a + 1, a + 6, a, a + 6, a + 5});
    }
  return out;
}
void expect_grid(const Mesh& mesh) { expect_box(mesh, 24, {0, 0, 0}, {4, 3, 3.072}, 1e-3); }

struct Packing {
  const char *extension, *mode;
  size_t count, stride;
  const char* filter = "NONE";
};

// A view of packed data, as gltfpack writes it: its unpacked form claims a place in a buffer that does not exist.
size_t packed_view(MadeGltf& made, const std::string& packed, const Packing& p) {
  const size_t lies = made.view(packed);
  Json extension = made.json["bufferViews"][lies];
  extension.update({{"mode", p.mode}, {"count", p.count}, {"byteStride", p.stride}, {"filter", p.filter}});
  made.json["bufferViews"].erase(lies);
  made.json["buffers"] = {Json::object(),
                          {{"byteLength", 1'000'000}, {"extensions", {{p.extension, {{"fallback", true}}}}}}};
  Json view = {{"buffer", 1}, {"byteLength", p.count * p.stride}, {"extensions", {{p.extension, extension}}}};
  if (std::string(p.mode) == "ATTRIBUTES") view["byteStride"] = p.stride;
  return made.add("bufferViews", view);
}

std::string packed_attributes(const void* data, size_t count, size_t stride) {
  std::string out(meshopt_encodeVertexBufferBound(count, stride), '\0');
  out.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(out.data()), out.size(), data, count, stride));
  return out;
}
std::string packed_faces(const std::vector<uint32_t>& faces, bool sequence) {
  std::string out(meshopt_encodeIndexBufferBound(faces.size(), 20) + 1000, '\0');
  auto* to = reinterpret_cast<unsigned char*>(out.data());
  out.resize(sequence ? meshopt_encodeIndexSequence(to, out.size(), faces.data(), faces.size())
                      : meshopt_encodeIndexBuffer(to, out.size(), faces.data(), faces.size()));
  return out;
}

std::string from_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  uint32_t bits = 0;
  int count = 0;
  for (const char c : text.substr(0, text.find('='))) {
    bits = bits << 6 | uint32_t(digits.find(c));
    if ((count += 6) >= 8) out += char(bits >> (count -= 8) & 255);
  }
  return out;
}
// The positions and colours (x / 4, y / 3, 1/2, 1), the latter with the filter COLOR, packed by meshoptimizer 1.2 in
// version 1 of its attribute codec.
const std::string kPositions1 = from_base64(
    "oRymAQCAAQB9h42D9H2HjYP0fYeNg/R9h42DAQEQRBEEAAEBIIR9h40CAAAAExdCYugPAAMFDwUAAAAAAAAAAAAAAAAAAAAAAAAAAAAAUgI=");
const std::string kColours1 = from_base64(
    "ob8AICAgICsiIB4gKSAgHiIrICAgIABAQD5A/UBAPkD9QEA+QP1AQD5AAB8fHR/SHR8fH9QfHx8d0h8fHR8AAAAAAAAAAAAAAAAA"
    "AAAAAAAAIMDg/wA=");

MadeGltf grid(const std::string& positions, const char* extension, bool sequence = false) {
  MadeGltf made;
  made.json["extensionsRequired"] = {"KHR_mesh_quantization", extension};
  const auto faces = grid_faces();
  const size_t p = packed_view(made, positions, {extension, "ATTRIBUTES", 20, 8});
  const size_t i = packed_view(made, packed_faces(faces, sequence),
                               {extension, sequence ? "INDICES" : "TRIANGLES", faces.size(), 4});
  made.show({{"attributes", {{"POSITION", made.bare_accessor(5123, 20, 3, {{"bufferView", p}})}}},
             {"indices", made.bare_accessor(5125, faces.size(), 1, {{"bufferView", i}})}},
            {{"scale", {0.001, 0.001, 0.001}}});
  return made;
}

TEST(GltfMeshopt, BothExtensionsAllModes) {
  const std::string positions = packed_attributes(grid_positions().data(), 20, 8);
  for (const char* extension : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
    for (const bool sequence : {false, true}) expect_grid(read(grid(positions, extension, sequence).glb()));
}

TEST(GltfMeshopt, VersionOneOfAttributes) {
  MadeGltf made = grid(kPositions1, "KHR_meshopt_compression");
  const size_t view = packed_view(made, kColours1, {"KHR_meshopt_compression", "ATTRIBUTES", 20, 4, "COLOR"});
  made.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
      made.bare_accessor(5121, 20, 4, {{"bufferView", view}, {"normalized", true}});
  const Mesh mesh = read(made.glb());
  expect_grid(mesh);
  const auto expected = grid_positions();
  ASSERT_EQ(mesh.positions.size(), 20u);
  for (size_t v = 0; v < 20; ++v)
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(mesh.positions[v][a], expected[4 * v + size_t(a)] * 0.001, 1e-9);
  EXPECT_EQ(mesh.colours.size(), 20u);
  EXPECT_NEAR(int(mesh.colours[4] >> 16), 255, 2) << "red grows with x";
  EXPECT_NEAR(int(mesh.colours[4] >> 8 & 255), 0, 13) << "a step of 255 in linear light";
  EXPECT_NEAR(int(mesh.colours[15] >> 8 & 255), 255, 2) << "green with y";
  EXPECT_NEAR(int(mesh.colours[15] & 255), 0xbc, 2);
}

TEST(GltfMeshopt, FiltersOfNormalsAndFloats) {
  std::vector<float> normals, places;
  for (int i = 0; i < 20; ++i) {
    const double a = 0.3 * i, b = 0.2 * i;
    const glm::vec3 n(std::cos(a) * std::cos(b), std::sin(a) * std::cos(b), std::sin(b));
    normals.insert(normals.end(), {n.x, n.y, n.z, 0});
    places.insert(places.end(), {float(i % 5), float(i / 5), float(i % 5 * (i / 5)) * 0.256f});
  }
  std::vector<int8_t> octahedral(80);
  meshopt_encodeFilterOct(octahedral.data(), 20, 4, 8, normals.data());
  std::vector<uint32_t> exponential(60);
  meshopt_encodeFilterExp(exponential.data(), 20, 12, 15, places.data());
  MadeGltf made;
  constexpr const char* kName = "EXT_meshopt_compression";
  const size_t n =
      packed_view(made, packed_attributes(octahedral.data(), 20, 4), {kName, "ATTRIBUTES", 20, 4, "OCTAHEDRAL"});
  const size_t p =
      packed_view(made, packed_attributes(exponential.data(), 20, 12), {kName, "ATTRIBUTES", 20, 12, "EXPONENTIAL"});
  const size_t faces = made.accessor(grid_faces(), 1);
  made.show({{"attributes",
              {{"POSITION", made.bare_accessor(5126, 20, 3, {{"bufferView", p}})},
               {"NORMAL", made.bare_accessor(5120, 20, 3, {{"bufferView", n}, {"normalized", true}})}}},
             {"indices", faces}});
  const Mesh mesh = read(made.glb());
  expect_grid(mesh);
  ASSERT_EQ(mesh.normals.size(), 20u);
  for (size_t v = 0; v < 20; ++v)
    EXPECT_GT(glm::dot(mesh.normals[v], glm::vec3(normals[4 * v], normals[4 * v + 1], normals[4 * v + 2])), 0.999f);
}

TEST(GltfMeshopt, DamageIsRefusedAndNamed) {
  for (const std::string& whole : {kPositions1, packed_attributes(grid_positions().data(), 20, 8)})
    for (size_t length = 0; length < whole.size(); ++length) {
      const std::string text = refusal(grid(whole.substr(0, length), "KHR_meshopt_compression").glb());
      EXPECT_NE(text.find("KHR_meshopt_compression is damaged"), std::string::npos) << text;
    }
  MadeGltf made = grid(kPositions1, "KHR_meshopt_compression");
  Json& packed = made.json["bufferViews"][0]["extensions"]["KHR_meshopt_compression"];
  for (const auto& [key, value] : {std::pair<const char*, Json>{"count", 4'000'000'000u},
                                   {"byteStride", 7},
                                   {"byteStride", 0},
                                   {"byteStride", 1024},
                                   {"mode", "HEAPS"},
                                   {"filter", "OCTAGONAL"},
                                   {"count", 19}}) {
    const Json before = packed[key];
    packed[key] = value;
    EXPECT_NE(refusal(made.glb()).find("is damaged"), std::string::npos) << key;
    packed[key] = before;
  }
}

struct DracoGrid {
  std::string bytes;
  uint32_t positions, colours;
};
DracoGrid draco_grid() {
  const auto places = grid_positions();
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(24);
  const int p = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int c = builder.AddAttribute(draco::GeometryAttribute::COLOR, 3, draco::DT_UINT8);
  const auto faces = grid_faces();
  for (size_t f = 0; f < 24; ++f) {
    float at[3][3];
    uint8_t red[3][3];
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t v = faces[3 * f + k];
      for (size_t a = 0; a < 3; ++a) at[k][a] = float(places[4 * v + a]) * 0.001f, red[k][a] = a == 0 ? 255 : 0;
    }
    const draco::FaceIndex face{uint32_t(f)};
    builder.SetAttributeValuesForFace(p, face, at[0], at[1], at[2]);
    builder.SetAttributeValuesForFace(c, face, red[0], red[1], red[2]);
  }
  const auto mesh = builder.Finalize();
  draco::Encoder encoder;
  encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 14);
  draco::EncoderBuffer out;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &out).ok());
  return {{out.data(), out.size()}, mesh->attribute(p)->unique_id(), mesh->attribute(c)->unique_id()};
}

MadeGltf packed_by_draco(const std::string& bytes, uint32_t positions, uint32_t colours) {
  MadeGltf made;
  made.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  const Json packed = {{"bufferView", made.view(bytes)},
                       {"attributes", {{"POSITION", positions}, {"COLOR_0", colours}}}};
  const size_t p = made.bare_accessor(5126, 20, 3), i = made.bare_accessor(5125, 72, 1);
  const size_t c = made.bare_accessor(5121, 20, 3, {{"normalized", true}});
  made.show({{"attributes", {{"POSITION", p}, {"COLOR_0", c}}},
             {"indices", i},
             {"extensions", {{"KHR_draco_mesh_compression", packed}}}});
  return made;
}

TEST(GltfDraco, TrianglesAndColours) {
  const DracoGrid packed = draco_grid();
  const Mesh mesh = read(packed_by_draco(packed.bytes, packed.positions, packed.colours).glb());
  expect_grid(mesh);
  EXPECT_EQ(mesh.colours, std::vector<uint32_t>(mesh.positions.size(), 0xff0000));
}

TEST(GltfDraco, DamageIsRefusedAndNamed) {
  const DracoGrid packed = draco_grid();
  for (size_t length = 0; length < packed.bytes.size(); length += 7) {
    const std::string text =
        refusal(packed_by_draco(packed.bytes.substr(0, length), packed.positions, packed.colours).glb());
    EXPECT_NE(text.find("KHR_draco_mesh_compression is damaged"), std::string::npos) << text;
  }
  EXPECT_NE(refusal(packed_by_draco(packed.bytes, 77, 78).glb()).find("no attribute 7"), std::string::npos);
}

}  // namespace
}  // namespace telesplat::data::test
