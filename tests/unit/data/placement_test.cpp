// From data coordinates to room space: precision, turning, degenerate triangles, normals, the guess of the up axis.
#include <glm/gtc/matrix_access.hpp>
#include <glm/matrix.hpp>

#include "services/data/mesh/placing/placement.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

Result<PlacedMesh> place(Mesh mesh, const std::string& up = "y", double room_size_m = 0.8, double crease_deg = 40) {
  return place_mesh(std::move(mesh), {.room_size_m = room_size_m, .up = up, .crease_deg = crease_deg}, "test");
}

TEST(RotationForUp, TurnsThatAxisToYWithoutMirroring) {
  const std::vector<std::pair<std::string, glm::dvec3>> axes = {
      {"x", {1, 0, 0}}, {"y", {0, 1, 0}}, {"z", {0, 0, 1}}, {"-x", {-1, 0, 0}}, {"-y", {0, -1, 0}}, {"-z", {0, 0, -1}}};
  for (const auto& [name, axis] : axes) {
    const auto rotation = rotation_for_up(name);
    ASSERT_TRUE(rotation.ok());
    EXPECT_EQ(*rotation * axis, glm::dvec3(0, 1, 0)) << name;
    EXPECT_EQ(glm::determinant(*rotation), 1.0) << name;
    EXPECT_EQ(glm::transpose(*rotation) * *rotation, glm::dmat3(1.0)) << name;
  }
  EXPECT_FALSE(rotation_for_up("up").ok());
}

TEST(RotationForUp, APatientStandsInOneWay) {
  const glm::dmat3 to_lps({-1, 0, 0}, {0, -1, 0}, {0, 0, 1});
  EXPECT_EQ(*rotation_for_up("z", scene::Space::kRas), *rotation_for_up("z", scene::Space::kLps) * to_lps);
  for (const std::string up : {"x", "y", "z", "-x", "-y", "-z"}) {
    const glm::dmat3 ras = *rotation_for_up(up, scene::Space::kRas), plain = *rotation_for_up(up);
    EXPECT_EQ(glm::transpose(ras)[1], glm::transpose(plain)[1]) << up << ": the file's own axis points up";
    EXPECT_EQ(glm::determinant(ras), 1.0) << up;
  }
  EXPECT_FALSE(rotation_for_up("up", scene::Space::kRas).ok());
}

TEST(PlaceMesh, CentresAndScalesToTheRoomSize) {
  Mesh mesh;
  mesh.positions = {{100, 5, -3}, {104, 5, -3}, {100, 6, -1}, {1e9, 1e9, 1e9}};  // no triangle uses the last one
  mesh.indices = {0, 1, 2};
  const auto placed = place(mesh, "y", 2.0);
  ASSERT_TRUE(placed.ok());
  EXPECT_EQ(placed->box_data, (geometry::DBox{{100, 5, -3}, {104, 6, -1}}));
  EXPECT_EQ(placed->box_room, (geometry::Box{{-1, -0.25f, -0.5f}, {1, 0.25f, 0.5f}}));
  EXPECT_EQ(placed->colours, std::vector<uint32_t>(4, kNeutralAlbedo));
}

// UTM-like offsets leave a float a resolution of some 0.5 m; the mesh here has details of millimetres.
TEST(PlaceMesh, LargeOffsetsLoseNothing) {
  for (const double offset : {0.0, 1e7, 4.6e9}) {
    Mesh near_origin = wavy_grid(10), far = near_origin;
    for (auto& p : far.positions) p = p * 0.0625 + glm::dvec3(offset, -offset, offset);  // 1/16: exact at these offsets
    for (auto& p : near_origin.positions) p = p * 0.0625;
    const auto a = place(near_origin, "z"), b = place(far, "z");
    ASSERT_TRUE(a.ok() && b.ok());
    for (size_t i = 0; i < a->positions_room.size(); ++i)
      EXPECT_LT(glm::distance(a->positions_room[i], b->positions_room[i]), offset > 1e8 ? 2e-6f : 2e-8f)
          << i << " at offset " << offset;
  }
}

TEST(PlaceMesh, DropsAndCountsDegenerateTriangles) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {1, 0, 0}};
  mesh.indices = {0, 1, 2, 0, 1, 1, 0, 1,
                  3, 1, 4, 2, 0, 3, 2};  // good, repeated index, a line, two corners at one place, good
  mesh.degenerate_dropped = 5;
  const auto placed = place(mesh);
  ASSERT_TRUE(placed.ok());
  EXPECT_EQ(placed->indices, (std::vector<uint32_t>{0, 1, 2, 0, 3, 2}));
  EXPECT_EQ(placed->degenerate_dropped, 8u);
}

TEST(PlaceMesh, NormalsAreMeansOverTrianglesWeightedByArea) {
  Mesh
      // one edge, a large triangle on one side (normal +z), one of a quarter of its area on the other (normal +y)
      mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 4, 0}, {0, 0, -1}};
  mesh.indices = {0, 1, 2, 0, 1, 3};
  const auto placed = place(mesh, "y", 0.8, 180);
  ASSERT_TRUE(placed.ok());
  const glm::vec3 expected = glm::normalize(glm::vec3(0, 1, 4));
  EXPECT_LT(glm::distance(image::decode_normal32(placed->normals[0]), expected), 1e-3f);
  EXPECT_LT(glm::distance(image::decode_normal32(placed->normals[2]), glm::vec3(0, 0, 1)), 1e-3f);
  EXPECT_LT(glm::distance(image::decode_normal32(placed->normals[3]), glm::vec3(0, 1, 0)), 1e-3f);
}

TEST(PlaceMesh, NormalsOfTheFileTurnAlongAndGapsAreFilled) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.indices = {0, 1, 2};
  mesh.normals = {{0, 0, 5}, {0, 0, 0}, {std::nanf(""), 0, 1}};
  const auto placed = place(mesh, "z");
  ASSERT_TRUE(placed.ok());
  for (uint32_t n : placed->normals) EXPECT_LT(glm::distance(image::decode_normal32(n), glm::vec3(0, 1, 0)), 1e-3f);
}

TEST(PlaceMesh, TinyAndHugeUnitsWork) {
  for (const double unit : {1e-12, 1e-3, 1e12}) {
    Mesh mesh = wavy_grid(4);
    for (auto& p : mesh.positions) p *= unit;
    const auto placed = place(mesh);
    ASSERT_TRUE(placed.ok()) << unit;
    EXPECT_EQ(placed->indices.size(), 96u) << unit;
    EXPECT_FLOAT_EQ(placed->box_room.size().x, 0.8f) << unit;
  }
}

// Vertices of a sphere as marching cubes over a grid of n^3 voxels would place them.
Mesh isosurface(int n) {
  Mesh mesh;
  const auto value = [n](glm::dvec3 p) { return glm::length(p - glm::dvec3(0.5 * n + 0.1)) - 0.37 * n; };
  for (int x = 0; x < n; ++x)
    for (int y = 0; y < n; ++y)
      for (int z = 0; z < n; ++z)
        for (int axis = 0; axis < 3; ++axis) {
          glm::dvec3 a(x, y, z), b = a;
          b[axis] += 1;
          if (value(a) * value(b) < 0) mesh.positions.push_back(glm::mix(a, b, value(a) / (value(a) - value(b))) * 0.9);
        }
  for (uint32_t i = 2; i < mesh.positions.size(); ++i) mesh.indices.insert(mesh.indices.end(), {i - 2, i - 1, i});
  return mesh;
}

Mesh sphere(int n) {
  Mesh mesh;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const double a = 2 * 3.14159265 * i / n, b = 3.14159265 * j / n;
      mesh.positions.emplace_back(std::cos(a + 0.1 * j) * std::sin(b), std::cos(b) * 1.7,
                                  std::sin(a + 0.1 * j) * std::sin(b));
    }
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const auto at = static_cast<uint32_t>(j * (n + 1) + i), below = at + static_cast<uint32_t>(n) + 1;
      mesh.indices.insert(mesh.indices.end(), {at, at + 1, below, at + 1, below + 1, below});
    }
  return mesh;
}

TEST(GuessUp, TerrainsAndMedicalDataStandOnZ) {
  EXPECT_EQ(guess_up(wavy_grid(30)).axis, "z");
  ASSERT_GT(isosurface(60).positions.size(), 2000u);
  EXPECT_EQ(guess_up(isosurface(60)).axis, "z");
  EXPECT_EQ(place(isosurface(60))->positions_room.size(), isosurface(60).positions.size()) << "it is split nowhere";
  Mesh vtk = sphere(20);
  vtk.format = "vtp";
  EXPECT_EQ(guess_up(vtk).axis, "z");
}

TEST(GuessUp, OthersOnY) {
  EXPECT_EQ(guess_up(sphere(80)).axis, "y");
  Mesh flat = sphere(80);  // flat, but closed: no terrain
  for (auto& p : flat.positions) p.z *= 0.1;
  EXPECT_EQ(guess_up(flat).axis, "y");
  Mesh boxes;  // a CAD-like model: everything on a grid
  for (int x = 0; x < 20; ++x)
    for (int y = 0; y < 20; ++y)
      for (int z = 0; z < 20; ++z) boxes.positions.emplace_back(x, y, z);
  for (uint32_t i = 2; i < boxes.positions.size(); ++i) boxes.indices.insert(boxes.indices.end(), {i - 2, i - 1, i});
  EXPECT_EQ(guess_up(boxes).axis, "y");
  Mesh terrain = wavy_grid(30);  // a terrain with y up
  for (auto& p : terrain.positions) std::swap(p.y, p.z);
  EXPECT_EQ(guess_up(terrain).axis, "y");
}

}  // namespace
}  // namespace telesplat::data::test
