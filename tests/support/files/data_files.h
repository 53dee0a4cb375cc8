// Files and meshes for the tests of services/data.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "common/geometry/chunk_code.h"
#include "common/image/normal.h"
#include "services/data/base/mesh.h"
#include "services/data/kinds.h"

namespace telesplat::data::test {

/// A temporary folder; the destructor deletes it.
class TempFolder {
 public:
  TempFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "telesplat-test-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TempFolder() { std::filesystem::remove_all(path_); }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }
  std::string write(const std::string& name, const std::string& content) const {
    std::ofstream(*this / name, std::ios::binary) << content;
    return *this / name;
  }

 private:
  std::string path_;
};

/// The bytes of a value, in either byte order.
template <class T>
std::string raw(T value, bool big_endian = false) {
  std::string out(sizeof value, '\0');
  std::memcpy(out.data(), &value, sizeof value);
  return big_endian ? std::string(out.rbegin(), out.rend()) : out;
}

/// A wavy grid of 2 n^2 triangles over [0, n]^2 with heights around 0, coloured by place.
inline Mesh wavy_grid(uint32_t n, double height = 0.3) {
  Mesh mesh;
  for (uint32_t j = 0; j <= n; ++j)
    for (uint32_t i = 0; i <= n; ++i) {
      mesh.positions.emplace_back(i, j, height * std::sin(0.7 * i) * std::cos(0.9 * j));
      mesh.colours.push_back(pack_rgb(i % 256, j % 256, (i + j) % 256));
    }
  for (uint32_t j = 0; j < n; ++j)
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      mesh.indices.insert(mesh.indices.end(), {a, b, d, a, d, c});
    }
  return mesh;
}

/// Ascii PLY of the mesh, with colours if it has any, in full precision.
inline std::string ply_of(const Mesh& mesh) {
  std::string out =
      fmt::format("ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n",
                  mesh.positions.size());
  if (!mesh.colours.empty()) out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  out += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.indices.size() / 3);
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    const auto& p = mesh.positions[i];
    out += fmt::format("{} {} {}", p.x, p.y, p.z);
    if (!mesh.colours.empty())
      out += fmt::format(" {} {} {}", mesh.colours[i] >> 16, mesh.colours[i] >> 8 & 255, mesh.colours[i] & 255);
    out += '\n';
  }
  for (size_t t = 0; t < mesh.indices.size(); t += 3)
    out += fmt::format("3 {} {} {}\n", mesh.indices[t], mesh.indices[t + 1], mesh.indices[t + 2]);
  return out;
}

/// Options for a test: no cache, and the data's own axes.
inline MeshOptions plain_options(const std::string& up = "y") {
  MeshOptions options;
  options.up = up;
  options.use_cache = false;
  return options;
}

/// Triangles of a store.
struct Corner {
  glm::vec3 position, normal;
  uint32_t colour;
};
struct Contents {
  std::vector<std::array<Corner, 3>> triangles;
  double area() const {
    double sum = 0;
    for (const auto& t : triangles)
      sum += 0.5 * glm::length(glm::cross(glm::dvec3(t[1].position) - glm::dvec3(t[0].position),
                                          glm::dvec3(t[2].position) - glm::dvec3(t[0].position)));
    return sum;
  }
};
inline Contents contents_of(const MeshStore& store) {
  Contents out;
  for (const auto& info : store.leaves()) {
    const auto bytes = store.chunk(info.id);
    const auto chunk = geometry::decode_chunk(bytes.bytes);
    if (!chunk) {
      ADD_FAILURE() << chunk.error().text;
      continue;
    }
    const auto* view = &chunk->view;
    EXPECT_EQ(view->triangles(), info.triangles);
    EXPECT_EQ(view->box_room, info.box_room);
    EXPECT_EQ(bytes.bytes.size(), info.bytes);
    geometry::Box box;
    for (size_t t = 0; t < view->triangles(); ++t) {
      std::array<Corner, 3> corners;
      for (int k = 0; k < 3; ++k) {
        const uint32_t v = view->indices[3 * t + k];
        corners[k] = {{view->positions_room[3 * v], view->positions_room[3 * v + 1], view->positions_room[3 * v + 2]},
                      image::decode_normal32(view->normals[v]),
                      view->colours[v]};
        box.extend(corners[k].position);
      }
      // Coded chunks may turn corners.
      const auto first = std::ranges::min_element(
          corners, {}, [](const Corner& c) { return std::tuple(c.position.x, c.position.y, c.position.z); });
      std::rotate(corners.begin(), first, corners.end());
      out.triangles.push_back(corners);
    }
    EXPECT_EQ(box, info.box_room);
  }
  return out;
}

inline std::shared_ptr<MeshStore> open_or_fail(const std::string& path, const MeshOptions& options) {
  auto store = open_mesh(path, options, nullptr);
  EXPECT_TRUE(store.ok()) << (store ? "" : store.error().text);
  return store ? *store : nullptr;
}

}  // namespace telesplat::data::test
