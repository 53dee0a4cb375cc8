#include "services/data/surface/isosurface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <map>
#include <numeric>
#include <random>

#include "common/volume/histogram.h"

namespace telesplat::data {
namespace {

// A ball of radius 8 around (12, 11, 10), value 100 at its surface and 10 more or less a voxel; the placement may
// mirror.
template <class T>
Volume ball(VoxelType type, const glm::dmat4& index_to_data, double scale = 1, double offset = 0) {
  Volume v;
  v.size = {26, 24, 22};
  v.type = type;
  v.index_to_data = index_to_data;
  v.scale = scale;
  v.offset = offset;
  v.lo = 1e300, v.hi = -1e300;
  for (int k = 0; k < 22; ++k)
    for (int j = 0; j < 24; ++j)
      for (int i = 0; i < 26; ++i) {
        const double value = 100 + 10 * (8 - glm::distance(glm::dvec3(i, j, k), glm::dvec3(12, 11, 10)));
        const T stored = T(std::max((value - offset) / scale, std::is_unsigned_v<T> ? 0.0 : -120.0));
        const auto* bytes = reinterpret_cast<const std::byte*>(&stored);
        v.stored.insert(v.stored.end(), bytes, bytes + sizeof stored);
        v.lo = std::min(v.lo, double(stored) * scale + offset);
        v.hi = std::max(v.hi, double(stored) * scale + offset);
      }
  return v;
}

glm::dmat4 placement(double mirror) {
  glm::dmat4 m(1);
  m[0] = {2 * mirror, 0, 0, 0};
  m[1] = {0, 1.5, 0, 0};
  m[2] = {0, 0.2, 3, 0};
  m[3] = {-5, 7, 100, 1};
  return m;
}

void check_ball(const Volume& volume) {
  const auto mesh = isosurface(volume, 100, "ball");
  ASSERT_TRUE(mesh) << mesh.error().text;
  ASSERT_TRUE(validate_mesh(*mesh, "ball"));
  EXPECT_GT(mesh->indices.size(), 3u * 1000);
  const auto histogram = volume::histogram_from_text(mesh->arrays[0].histogram);
  ASSERT_TRUE(histogram) << "people choose another value by it";
  EXPECT_EQ(std::accumulate(histogram->counts.begin(), histogram->counts.end(), uint64_t{0}), 26u * 24 * 22);
  const glm::dmat4 back = glm::inverse(volume.index_to_data);
  for (const auto& p : mesh->positions)
    EXPECT_NEAR(glm::distance(glm::dvec3(back * glm::dvec4(p, 1)), glm::dvec3(12, 11, 10)), 8, 0.35);
  // Triangles face outward in the data's own axes, mirrored or not; so do normals.
  const glm::dvec3 centre = volume.index_to_data * glm::dvec4(12, 11, 10, 1);
  double volume_of = 0;
  for (size_t i = 0; i < mesh->indices.size(); i += 3) {
    const auto p = [&](size_t c) { return mesh->positions[mesh->indices[i + c]] - centre; };
    volume_of += glm::dot(p(0), glm::cross(p(1), p(2))) / 6;
  }
  EXPECT_NEAR(volume_of, 4.18879 * 512 * 9, 0.06 * 4.18879 * 512 * 9);
  ASSERT_EQ(mesh->normals.size(), mesh->positions.size());
  size_t outward = 0;
  for (size_t i = 0; i < mesh->normals.size(); ++i)
    outward += glm::dot(glm::dvec3(mesh->normals[i]), mesh->positions[i] - centre) > 0;
  EXPECT_EQ(outward, mesh->normals.size());
}

TEST(Isosurface, OfABallInEveryType) {
  check_ball(ball<uint8_t>(VoxelType::kU8, placement(1)));
  check_ball(ball<int8_t>(VoxelType::kI8, placement(1), 2, 60));
  check_ball(ball<uint16_t>(VoxelType::kU16, placement(1)));
  check_ball(ball<int16_t>(VoxelType::kI16, placement(1), 0.5, -300));
  check_ball(ball<float>(VoxelType::kF32, placement(1)));
}

TEST(Isosurface, OfAMirroredVolumeFacesOutward) { check_ball(ball<float>(VoxelType::kF32, placement(-1))); }

TEST(Isosurface, RefusesValuesWithoutASurface) {
  const auto volume = ball<float>(VoxelType::kF32, placement(1));
  for (const double iso : {-500.0, 500.0, std::nan("")}) {
    const auto mesh = isosurface(volume, iso, "name");
    ASSERT_FALSE(mesh);
    EXPECT_NE(mesh.error().text.find("name: --iso"), std::string::npos) << mesh.error().text;
  }
  auto flat = volume;
  flat.size = {26, 24 * 22, 1};
  EXPECT_FALSE(isosurface(flat, 100, "flat"));
}

// Noise has every case of marching cubes: only triangles at the volume's border have open edges.
TEST(Isosurface, OfNoiseIsClosedWithinTheVolume) {
  Volume v;
  v.size = {37, 21, 40};
  v.type = VoxelType::kU8;
  std::mt19937 random(5);
  for (int i = 0; i < 37 * 21 * 40; ++i) v.stored.push_back(std::byte(random()));
  v.lo = 0, v.hi = 255;
  const auto mesh = isosurface(v, 128.5, "noise");
  ASSERT_TRUE(mesh) << mesh.error().text;
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  for (size_t i = 0; i < mesh->indices.size(); ++i) {
    const uint32_t a = mesh->indices[i], b = mesh->indices[i % 3 == 2 ? i - 2 : i + 1];
    a < b ? ++edges[{a, b}] : --edges[{b, a}];
  }
  const auto at_border = [&](uint32_t i) {
    for (int a = 0; a < 3; ++a)
      if (mesh->positions[i][a] == 0 || mesh->positions[i][a] == v.size[size_t(a)] - 1) return true;
    return false;
  };
  size_t open = 0;
  for (const auto& [edge, sides] : edges) open += sides != 0 && !(at_border(edge.first) && at_border(edge.second));
  EXPECT_EQ(open, 0u);
  std::vector<std::array<double, 3>> places;
  for (const auto& p : mesh->positions) places.push_back({p.x, p.y, p.z});
  std::sort(places.begin(), places.end());
  EXPECT_EQ(std::adjacent_find(places.begin(), places.end()), places.end()) << "each grid edge has one vertex";
}

TEST(Isosurface, TakesValuesThatAreNotFiniteForTheLowest) {
  Volume v = ball<float>(VoxelType::kF32, placement(1));
  const float nothing = std::nanf("");
  std::memcpy(v.stored.data(), &nothing, sizeof nothing);
  v.not_finite = 1;
  check_ball(v);
}

// If larger stored values mean lower ones, inside and outside change places.
TEST(Isosurface, OfANegativeScaleFacesLowerValues) { check_ball(ball<float>(VoxelType::kF32, placement(1), -2, 500)); }

}  // namespace
}  // namespace telesplat::data
