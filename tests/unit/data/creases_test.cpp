// Computed normals: flat faces stay flat, curved parts smooth, for any winding; and copied vertices keep their data.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>
#include <random>

#include "common/image/normal.h"
#include "services/data/mesh/placing/placement.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

struct Shape {
  std::vector<glm::vec3> positions;
  std::vector<uint32_t> indices;
  void add(uint32_t a, uint32_t b, uint32_t c) { indices.insert(indices.end(), {a, b, c}); }
  glm::vec3 face_normal(size_t t) const {
    const glm::vec3 a = positions[indices[3 * t]];
    return glm::normalize(glm::cross(positions[indices[3 * t + 1]] - a, positions[indices[3 * t + 2]] - a));
  }
};

// 8 vertices, 12 triangles that face outward.
Shape cube() {
  Shape s;
  for (int i = 0; i < 8; ++i) s.positions.emplace_back(i & 1, i >> 1 & 1, i >> 2 & 1);
  for (const auto& [a, b, c, d] : {std::array{0u, 2u, 3u, 1u},
                                   {4u, 5u, 7u, 6u},
                                   {0u, 1u, 5u, 4u},
                                   {2u, 6u, 7u, 3u},
                                   {0u, 4u, 6u, 2u},
                                   {1u, 3u, 7u, 5u}})
    s.add(a, b, c), s.add(a, c, d);
  return s;
}

// A closed cylinder around z: `sides` faces, caps that are fans around a vertex of their own.
Shape cylinder(uint32_t sides) {
  Shape s;
  for (uint32_t i = 0; i < sides; ++i)
    for (const float z : {0.0f, 1.0f})
      s.positions.emplace_back(std::cos(2 * M_PI * i / sides), std::sin(2 * M_PI * i / sides), z);
  s.positions.emplace_back(0, 0, 0);
  s.positions.emplace_back(0, 0, 1);
  for (uint32_t i = 0; i < sides; ++i) {
    const uint32_t a = 2 * i, b = 2 * ((i + 1) % sides);
    s.add(a, b, b + 1), s.add(a, b + 1, a + 1), s.add(2 * sides, b, a), s.add(2 * sides + 1, a + 1, b + 1);
  }
  return s;
}

// Returns each corner's normal, of unit length. Copies have the positions of their originals.
std::vector<glm::vec3> corner_normals(Shape& s, double crease_deg, size_t* copies = nullptr) {
  const SmoothNormals made = smooth_normals(s.positions, crease_deg, s.indices);
  EXPECT_EQ(made.normals.size(), s.positions.size() + made.copies.size());
  if (copies) *copies = made.copies.size();
  for (const uint32_t vertex : made.copies) s.positions.push_back(glm::vec3(s.positions.at(vertex)));
  std::vector<glm::vec3> out;
  for (const uint32_t i : s.indices) out.push_back(glm::normalize(made.normals.at(i)));
  return out;
}

TEST(Creases, ACubeHasFlatFaces) {
  Shape s = cube();
  size_t copies = 0;
  const auto normals = corner_normals(s, 40, &copies);
  EXPECT_EQ(copies, 16u) << "three normals at each of eight corners";
  for (size_t c = 0; c < normals.size(); ++c) EXPECT_LT(glm::distance(normals[c], s.face_normal(c / 3)), 1e-6f) << c;
}

TEST(Creases, ACylinderIsSmoothAroundAndSharpAtItsCaps) {
  for (const uint32_t sides : {10u, 64u, 20000u}) {  // 36 degrees between sides; the last one has long fans
    Shape s = cylinder(sides);
    size_t copies = 0;
    const auto normals = corner_normals(s, 40, &copies);
    EXPECT_EQ(copies, 2 * sides);
    for (size_t c = 0; c < normals.size(); ++c) {
      const glm::vec3 p = s.positions[s.indices[c]];
      const bool cap = c / 3 % 4 >= 2;
      const glm::vec3 expected = cap ? glm::vec3(0, 0, p.z > 0.5f ? 1 : -1) : glm::vec3(p.x, p.y, 0);
      ASSERT_LT(glm::distance(normals[c], expected), cap ? 1e-5f : 0.11f) << sides << " corner " << c;
    }
  }
}

TEST(Creases, TheAngleDecides) {
  size_t copies = 0;
  Shape s = cylinder(8);  // 45 degrees
  corner_normals(s, 40, &copies);
  EXPECT_EQ(copies, 2 * 8u + 16u) << "each side by itself";
  s = cylinder(8);
  corner_normals(s, 50, &copies);
  EXPECT_EQ(copies, 16u);
  s = cylinder(8);
  const auto normals = corner_normals(s, 180, &copies);
  EXPECT_EQ(copies, 0u);
  for (size_t c = 0; c < normals.size(); ++c) {
    const glm::vec3 p = s.positions[s.indices[c]];
    if (glm::length(glm::vec2(p)) > 0.5f) EXPECT_GT(std::abs(normals[c].z), 0.3f) << "caps and sides have one normal";
  }
}

// Viewers light both sides, so the sign does not matter; but turned triangles must not cancel others in the sum.
TEST(Creases, TurnedTrianglesSpoilNoNormal) {
  std::mt19937 random(3);
  for (Shape whole : {cube(), cylinder(40)}) {
    Shape turned = whole;
    for (size_t t = 0; t < turned.indices.size() / 3; ++t)
      if (random() % 4 == 0) std::swap(turned.indices[3 * t + 1], turned.indices[3 * t + 2]);
    const std::vector<uint32_t> corners = turned.indices, before = whole.indices;
    size_t copies_whole = 0, copies_turned = 0;
    const auto expected = corner_normals(whole, 40, &copies_whole), got = corner_normals(turned, 40, &copies_turned);
    EXPECT_EQ(copies_turned, copies_whole);
    for (size_t c = 0; c < got.size(); ++c) {
      size_t same = c - c % 3;  // a corner of the same vertex
      while (before[same] != corners[c]) ++same;
      EXPECT_GT(std::abs(glm::dot(got[c], expected[same])), 0.9999f) << c;
    }
  }
}

// A surface with holes, borders, edges of three triangles and vertices where two parts touch.
TEST(Creases, EveryCornerKeepsItsPlaceOnAnyHeapOfTriangles) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (int round = 0; round < 50; ++round) {
    Shape s;
    for (int i = 0; i < 12; ++i) s.positions.emplace_back(unit(random), unit(random), unit(random));
    for (int t = 0; t < 40; ++t) {
      std::array<uint32_t, 12> all;
      std::iota(all.begin(), all.end(), 0u);
      std::shuffle(all.begin(), all.end(), random);
      s.add(all[0], all[1], all[2]);
    }
    const Shape before = s;
    const auto normals = corner_normals(s, 40);
    for (size_t c = 0; c < normals.size(); ++c) {
      ASSERT_EQ(s.positions[s.indices[c]], before.positions[before.indices[c]]) << c;
      ASSERT_TRUE(std::isfinite(normals[c].x));
    }
  }
}

TEST(Creases, CopiesTakeColoursAndScalarsAlong) {
  const Shape s = cube();
  Mesh mesh;
  for (const glm::vec3& p : s.positions) mesh.positions.emplace_back(p);
  mesh.indices = s.indices;
  for (uint32_t i = 0; i < 8; ++i) mesh.colours.push_back(0x010101 * i);
  const auto place = [](Mesh m, double crease_deg = 40) {
    return place_mesh(std::move(m), {.up = "y", .crease_deg = crease_deg}, "test");
  };
  const auto coloured = place(mesh);
  ASSERT_TRUE(coloured.ok());
  EXPECT_EQ(coloured->colours.size(), 24u);
  for (size_t c = 0; c < s.indices.size(); ++c)
    EXPECT_EQ(coloured->colours[coloured->indices[c]], 0x010101 * s.indices[c]) << c;
  Mesh scalar = mesh;
  scalar.colours.clear();
  scalar.scalars = {0, 1, 2, 3, 4, 5, 6, 7};
  const auto with_scalars = place(scalar);
  ASSERT_TRUE(with_scalars.ok());
  for (size_t c = 0; c < s.indices.size(); ++c)
    EXPECT_EQ(std::bit_cast<float>(with_scalars->colours[with_scalars->indices[c]]), float(s.indices[c])) << c;

  Mesh field = mesh, told = mesh;
  field.smooth = true;
  for (const glm::vec3& p : s.positions) told.normals.push_back(p - 0.5f);
  for (const Mesh& uncut : {field, told}) EXPECT_EQ(place(uncut)->positions_room.size(), 8u);
  EXPECT_EQ(place(mesh, 180)->positions_room.size(), 8u);
}

}  // namespace
}  // namespace telesplat::data::test
