// Triangles with different colours: vertices between them are doubled.
#include <gtest/gtest.h>

#include <chrono>

#include "services/data/base/mesh.h"
#include "services/data/mesh/placing/placement.h"

namespace telesplat::data {
namespace {

// Four triangles around vertex 0.
Mesh fan() {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
  mesh.indices = {0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1};
  mesh.normals.assign(5, {0, 0, 1});
  mesh.scalars = {5, 6, 7, 8, 9};
  return mesh;
}

TEST(ColourFaces, DoublesVerticesOnlyBetweenDifferentColours) {
  Mesh mesh = fan();
  const std::vector<glm::dvec3> before = mesh.positions;
  const std::vector<uint32_t> corners = mesh.indices, colours = {0xff0000, 0xff0000, 0x00ff00, 0x00ff00};
  colour_faces(mesh, colours);
  ASSERT_EQ(mesh.positions.size(), 8u);  // vertices 0, 1 and 3 have two colours
  ASSERT_EQ(mesh.normals.size(), 8u);
  ASSERT_EQ(mesh.scalars.size(), 8u);
  ASSERT_EQ(mesh.colours.size(), 8u);
  for (size_t i = 0; i < corners.size(); ++i) {
    EXPECT_EQ(mesh.positions[mesh.indices[i]], before[corners[i]]);
    EXPECT_EQ(mesh.colours[mesh.indices[i]], colours[i / 3]);
    EXPECT_EQ(mesh.scalars[mesh.indices[i]], float(5 + corners[i]));
  }
}

TEST(ColourFaces, LeavesTheColoursOfVerticesToFacesWithoutOne) {
  Mesh mesh = fan();
  mesh.colours = {1, 2, 3, 4, 5};
  colour_faces(mesh, std::vector<uint32_t>{kNoColour, 7, kNoColour, kNoColour});
  EXPECT_EQ(mesh.colours[mesh.indices[0]], 1u);
  EXPECT_EQ(mesh.colours[mesh.indices[3]], 7u);
  EXPECT_EQ(mesh.colours[mesh.indices[6]], 1u);
  EXPECT_EQ(mesh.colours[mesh.indices[8]], 5u);
  Mesh plain = fan();
  colour_faces(plain, std::vector<uint32_t>{kNoColour, 7, kNoColour, kNoColour});
  EXPECT_EQ(plain.colours[plain.indices[0]], kNeutralAlbedo);
}

TEST(ColourFaces, LeaveASurfaceAsSmoothAndAsSharpAsItWas) {
  for (const double height : {0.1, 5.0}) {  // smooth; creases at all edges
    Mesh plain = fan();
    plain.normals.clear(), plain.scalars.clear();
    plain.positions[0].z = height;
    Mesh coloured = plain;
    const std::vector<uint32_t> colours{0xff0000, 0xff0000, 0x00ff00, 0x0000ff};
    colour_faces(coloured, colours);
    const auto a = place_mesh(std::move(plain), {}, "plain"), b = place_mesh(std::move(coloured), {}, "coloured");
    ASSERT_TRUE(a.ok() && b.ok());
    ASSERT_EQ(a->indices.size(), b->indices.size());
    for (size_t i = 0; i < a->indices.size(); ++i) {
      EXPECT_EQ(a->normals[a->indices[i]], b->normals[b->indices[i]]) << height << " " << i;
      EXPECT_EQ(a->positions_room[a->indices[i]], b->positions_room[b->indices[i]]);
      EXPECT_EQ(b->colours[b->indices[i]], colours[i / 3]);
    }
  }
}

TEST(ColourFaces, EndsOnAMillionColoursAroundOneVertex) {
  Mesh mesh;
  std::vector<uint32_t> colours;
  for (uint32_t i = 0; i < 1'000'000; ++i) {
    mesh.positions.emplace_back(i, i * i, 0);
    mesh.indices.insert(mesh.indices.end(), {0, i, i / 2});
    colours.push_back(i);
  }
  const auto start = std::chrono::steady_clock::now();
  colour_faces(mesh, colours);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
  for (uint32_t i = 0; i < 1'000'000; ++i) ASSERT_EQ(mesh.colours[mesh.indices[3 * i]], i);
}

}  // namespace
}  // namespace telesplat::data
