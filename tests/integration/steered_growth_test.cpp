// Steered sampling along a loop that is walked several times: the model does not grow by that. Uses real meshes, ray
// sampler, packer and planner, without sockets.
#include <cmath>
#include <numbers>

#include "common/geometry/trajectory.h"
#include "tests/support/mesh_chunks.h"
#include "tests/support/steered_session.h"

namespace telesplat::packer {
namespace {

constexpr int kWidth = 240, kHeight = 150, kUpdates = 40;

// Upright rods, a few pixels thick, all around.
geometry::ChunkBytes rods() {
  constexpr uint32_t kSides = 10, kRods = 30;
  constexpr float kTurn = 2 * std::numbers::pi_v<float>;
  std::vector<test::Vertex> vertices;
  std::vector<uint32_t> indices;
  for (uint32_t rod = 0; rod < kRods; ++rod) {
    const float away = 0.08f + 0.1f * float(rod % 3), thick = 0.003f + 0.001f * float(rod % 4);
    const glm::vec3 foot(away * std::cos(kTurn * rod / kRods), -0.1f, away * std::sin(kTurn * rod / kRods));
    const auto first = uint32_t(vertices.size());
    for (uint32_t side = 0; side < kSides; ++side) {
      const glm::vec3 n(std::cos(kTurn * side / kSides), 0, std::sin(kTurn * side / kSides));
      vertices.push_back({foot + thick * n, n, 0x90a0b0});
      vertices.push_back({foot + thick * n + glm::vec3(0, 0.35f, 0), n, 0x90a0b0});
    }
    for (uint32_t side = 0; side < kSides; ++side) {
      const uint32_t a = first + 2 * side, b = first + 2 * ((side + 1) % kSides);
      indices.insert(indices.end(), {a, a + 1, b, b, a + 1, b + 1});
    }
  }
  return test::chunk_of(vertices, indices);
}

// Walks around the hills, at their border. No two rounds take the same views.
geometry::Camera walk(int round, int update) {
  const double at = 2 * std::numbers::pi * (update + 0.38 * round) / kUpdates;
  const glm::dvec3 eye(0.42 * std::sin(at), 0.22 + 0.04 * std::sin(3 * at), 0.42 * std::cos(at));
  return geometry::make_camera(geometry::look_at(eye, {0, 0.05, 0}), 60, kWidth, kHeight);
}

struct Garden : test::SteeredSession {
  explicit Garden(bool steering)
      : SteeredSession({glm::vec3(-0.4f, -0.2f, -0.4f), glm::vec3(0.4f, 0.3f, 0.4f)}, steering) {
    EXPECT_TRUE(sampler().add_chunks(test::terrain(100, 50)).ok());
    EXPECT_TRUE(sampler().add_chunk(ChunkId{1000}, rods()).ok());
  }
  // Returns the number of points afterwards.
  double round() {
    for (int i = 0; i < kUpdates; ++i) {
      update(walk(rounds, i));
      extra(2);
    }
    ++rounds;
    return double(core().model().points());
  }
  int rounds = 0;
};

// Rays from beside once sampled all surfaces that were shown more thinly than a head standing there could see: these
// two rounds added a third of the points, three times as many as without steering.
TEST(SteeredGrowth, ALoopThatIsWalkedAgainAddsNoMoreThanWithoutSteering) {
  constexpr int kRounds = 4;
  Garden steered(true), whole(false);
  double points[2][kRounds];
  for (int i = 0; i < kRounds; ++i) points[0][i] = steered.round(), points[1][i] = whole.round();
  const double grown = points[0][3] / points[0][1], grown_whole = points[1][3] / points[1][1];
  EXPECT_LT(grown, 1.05 * grown_whole) << points[0][1] << " to " << points[0][3];
  EXPECT_LT(points[0][3], 2.2 * points[1][3]);
  EXPECT_EQ(steered.forgotten(), 0u);
}

}  // namespace
}  // namespace telesplat::packer
