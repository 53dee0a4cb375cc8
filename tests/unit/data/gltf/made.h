// glTF files made in memory.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "services/data/gltf/reader.h"

namespace telesplat::data::test {

using Json = nlohmann::json;

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

template <class T>
constexpr int kComponent = std::is_same_v<T, int8_t>     ? 5120
                           : std::is_same_v<T, uint8_t>  ? 5121
                           : std::is_same_v<T, int16_t>  ? 5122
                           : std::is_same_v<T, uint16_t> ? 5123
                           : std::is_same_v<T, uint32_t> ? 5125
                                                         : 5126;

/// Companions in memory.
class Folder : public Companions {
 public:
  std::map<std::string, std::string> files;
  Result<std::string_view> read(const std::string& named) override {
    const auto found = files.find(named);
    if (found == files.end()) return Error{named + " is not there"};
    return std::string_view(found->second);
  }
};

/// A GLB file; tests add views, accessors and the rest.
class MadeGltf {
 public:
  Json json = {{"asset", {{"version", "2.0"}}}};
  std::string bin;

  size_t view(const std::string& bytes, Json more = Json::object()) {
    while (bin.size() % 4) bin += '\0';
    more.update({{"buffer", 0}, {"byteOffset", bin.size()}, {"byteLength", bytes.size()}});
    bin += bytes;
    return add("bufferViews", std::move(more));
  }
  size_t add(const char* kind, Json item) {
    json[kind].push_back(std::move(item));
    return json[kind].size() - 1;
  }
  template <class T>
  size_t accessor(const std::vector<T>& values, int width, Json more = Json::object()) {
    more.update({{"bufferView", view(bytes_of(values))}});
    return bare_accessor(kComponent<T>, values.size() / size_t(width), width, std::move(more));
  }
  size_t bare_accessor(int component, size_t count, int width, Json more = Json::object()) {
    const char* type = width == 1 ? "SCALAR" : width == 2 ? "VEC2" : width == 3 ? "VEC3" : width == 4 ? "VEC4" : "MAT4";
    more.update({{"componentType", component}, {"count", count}, {"type", type}});
    return add("accessors", std::move(more));
  }
  /// Adds a mesh of one primitive in a node of its own; returns the node.
  size_t show(Json primitive, Json node = Json::object()) {
    node["mesh"] = add("meshes", {{"primitives", {std::move(primitive)}}});
    return add("nodes", std::move(node));
  }

  std::string glb() const {
    Json whole = json;
    if (!whole.contains("buffers")) whole["buffers"] = Json::array({Json::object()});
    whole["buffers"][0]["byteLength"] = bin.size();
    std::string text = whole.dump(), data = bin;
    while (text.size() % 4) text += ' ';
    while (data.size() % 4) data += '\0';
    const auto size = [](size_t n) { return bytes_of(std::vector<uint32_t>{uint32_t(n)}); };
    return "glTF" + size(2) + size(28 + text.size() + data.size()) + size(text.size()) + "JSON" + text +
           size(data.size()) + std::string("BIN\0", 4) + data;
  }
};

inline Result<Mesh> try_gltf(const std::string& content) {
  Folder nothing;
  auto mesh = read_gltf(content, "a.glb", nothing, 100'000);
  EXPECT_TRUE(!mesh || validate_mesh(*mesh, "a.glb")) << "what is read is sound";
  return mesh;
}
inline Mesh read(const std::string& content) {
  auto mesh = try_gltf(content);
  EXPECT_TRUE(mesh) << mesh.error().text;
  return mesh ? std::move(*mesh) : Mesh{};
}
inline std::string refusal(const std::string& content) {
  const auto mesh = try_gltf(content);
  EXPECT_FALSE(mesh);
  return mesh ? "" : mesh.error().text;
}

inline void expect_box(const Mesh& mesh, size_t triangles, glm::dvec3 lower, glm::dvec3 upper, double within = 1e-5) {
  EXPECT_EQ(mesh.indices.size(), 3 * triangles);
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
  for (const uint32_t i : mesh.indices) low = min(low, mesh.positions[i]), high = max(high, mesh.positions[i]);
  EXPECT_LT(glm::distance(low, lower), within) << low.x << " " << low.y << " " << low.z;
  EXPECT_LT(glm::distance(high, upper), within) << high.x << " " << high.y << " " << high.z;
}

/// Returns six times the volume under the triangles: positive if they face outwards.
inline double volume(const Mesh& mesh) {
  double sum = 0;
  const auto at = [&](size_t i) { return mesh.positions[mesh.indices[i]]; };
  for (size_t i = 0; i < mesh.indices.size(); i += 3) sum += glm::dot(at(i), glm::cross(at(i + 1), at(i + 2)));
  return sum;
}

/// A tetrahedron with corners at the origin and on the axes: 4 triangles, six times its volume is 1.
inline const std::vector<float> kTetrahedron{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
inline const std::vector<uint16_t> kFaces{0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};

}  // namespace telesplat::data::test
