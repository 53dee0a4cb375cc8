// Reads clouds and asks what they hold, for tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "services/data/mesh/reader.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {

inline Mesh read(const std::string& path, const std::string& array = {}) {
  auto mesh = read_mesh(path, nullptr, {}, array);
  EXPECT_TRUE(mesh.ok()) << (mesh ? "" : mesh.error().text);
  return mesh ? std::move(*mesh) : Mesh();
}

inline Mesh read_text(const std::string& name, const std::string& content, const std::string& array = {}) {
  const TempFolder folder;
  return read(folder.write(name, content), array);
}

/// The middle of a point's square, in the file's coordinates.
inline glm::dvec3 point(const Mesh& mesh, size_t i) {
  return (mesh.positions[4 * i] + mesh.positions[4 * i + 2]) * 0.5 / mesh.coordinates.shown;
}
inline size_t points(const Mesh& mesh) { return mesh.positions.size() / 4; }

inline void expect_near(const glm::dvec3& a, const glm::dvec3& b, double most) {
  EXPECT_NEAR(a.x, b.x, most);
  EXPECT_NEAR(a.y, b.y, most);
  EXPECT_NEAR(a.z, b.z, most);
}

inline const scene::ArrayInfo& array(const Mesh& mesh, const std::string& name) {
  const auto found =
      std::find_if(mesh.arrays.begin(), mesh.arrays.end(), [&](const auto& a) { return a.name == name; });
  if (found != mesh.arrays.end()) return *found;
  ADD_FAILURE() << "no array " << name;
  static const scene::ArrayInfo none{.name = "", .unit = "", .spans = {{}}, .histogram = ""};
  return none;
}

inline std::string remarks(const Mesh& mesh) {
  std::string out;
  for (const std::string& note : mesh.notes) out += note + '\n';
  return out;
}

/// A file of the real data; empty: it is missing, and the test is skipped.
inline std::string real(const std::string& name) {
  const char *folder = std::getenv("TELESPLAT_DATA"), *home = std::getenv("HOME");
  const std::string path =
      (folder ? folder : std::string(home ? home : "") + "/.cache/telesplat-data") + "/points/" + name;
  return std::filesystem::exists(path) ? path : "";
}
#define REAL_FILE(path, name)          \
  const std::string path = real(name); \
  if (path.empty()) GTEST_SKIP() << name << " is not there (set TELESPLAT_DATA)"

}  // namespace telesplat::data::test
