// Steered sampling of data that change without an epoch: the model is right again within two seconds of updates, and
// nothing is forgotten if the data do not change. Uses real meshes, ray sampler, packer and planner, without sockets.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "common/geometry/trajectory.h"
#include "services/data/kinds.h"
#include "services/packer/points/plan/validation.h"
#include "services/packer/points/plan/view/view_map.h"
#include "tests/support/mesh_chunks.h"
#include "tests/support/steered_session.h"

namespace telesplat::packer {
namespace {

constexpr int kUpdatesInTwoSeconds = 20, kWidth = 640, kHeight = 400;
constexpr ChunkId kBall{1000};

// A ball of triangles.
geometry::ChunkBytes ball(const glm::vec3& centre, float radius, uint32_t colour) {
  constexpr uint32_t kColumns = 48, kRows = 24;
  std::vector<test::Vertex> vertices;
  std::vector<uint32_t> indices;
  for (uint32_t j = 0; j <= kRows; ++j)
    for (uint32_t i = 0; i <= kColumns; ++i) {
      const float turn = 2 * float(M_PI) * float(i) / kColumns, tilt = float(M_PI) * float(j) / kRows;
      const glm::vec3 n(std::sin(tilt) * std::cos(turn), std::cos(tilt), std::sin(tilt) * std::sin(turn));
      vertices.push_back({centre + radius * n, n, colour});
    }
  for (uint32_t j = 0; j < kRows; ++j)
    for (uint32_t i = 0; i < kColumns; ++i) {
      const uint32_t a = j * (kColumns + 1) + i, b = a + kColumns + 1;
      indices.insert(indices.end(), {a, a + 1, b, a + 1, b + 1, b});
    }
  return test::chunk_of(vertices, indices);
}

geometry::Camera walk(int update, double height = 0.35) {
  const double turn = 0.015 * update;
  return geometry::make_camera(geometry::look_at({0.65 * std::sin(turn), height, 0.65 * std::cos(turn)}, {0, 0, 0}), 70,
                               kWidth, kHeight);
}

struct Session : test::SteeredSession {
  using SteeredSession::SteeredSession;

  // Counts the pixels of a view where the model differs from the data, or shows nothing.
  size_t wrong(const geometry::Camera& camera) {
    splat::ViewKeys keys(2);
    ViewMap map;
    render_view_map(core().model(), camera, {}, keys, map);
    const image::DepthImage there = sampler().sample(camera, {0, 0, camera.width, camera.height});
    const Validation judge(core().model().config());
    size_t out = 0;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const auto verdict = judge.judge({map.camera, map.depth_m, map.colour, map.normal, map.covered}, x, y, there,
                                         size_t(y) * camera.width + x);
        out += verdict != Validation::Verdict::kAgrees && verdict != Validation::Verdict::kNone && !map.edge.at(x, y);
      }
    return out;
  }
};

// Terrain with a ball above it.
struct Hills : Session {
  Hills() : Session({glm::vec3(-0.4f, -0.2f, -0.4f), glm::vec3(0.4f, 0.3f, 0.4f)}) {
    EXPECT_TRUE(sampler().add_chunks(test::terrain(200, 50)).ok());
    put_ball({0.1f, 0.14f, 0.1f}, 0xc02020);
    for (; at < 15; ++at) update(walk(at));
  }
  void put_ball(const glm::vec3& centre, uint32_t colour) {
    EXPECT_TRUE(sampler().add_chunk(kBall, ball(centre, 0.08f, colour)).ok());
  }
  // Fewer than one pixel in 500 is wrong, at the eye's place and beside it.
  void expect_right_after_two_seconds() {
    const size_t first = wrong(walk(at));
    EXPECT_GT(first, size_t{kWidth} * kHeight / 200) << "nothing changed";
    for (int i = 0; i < kUpdatesInTwoSeconds; ++i) update(walk(++at));
    EXPECT_LT(wrong(walk(at)), size_t{kWidth} * kHeight / 500);
    EXPECT_LT(wrong(walk(at + 2)), size_t{kWidth} * kHeight / 300);
    EXPECT_GT(forgotten(), 0u);
  }
  int at = 0;
};

TEST(SteeredChanges, WhatDoesNotChangeIsNotForgotten) {
  Hills hills;
  uint64_t rays = 0;
  for (int i = 0; i < 60; ++i) rays += hills.update(walk(++hills.at));
  EXPECT_EQ(hills.forgotten(), 0u);
  EXPECT_LT(double(rays), 0.2 * 60 * kWidth * kHeight);
  EXPECT_LT(hills.wrong(walk(hills.at)), size_t{kWidth} * kHeight / 500);
}

TEST(SteeredChanges, AThingThatIsTakenAwayIsGone) {
  Hills hills;
  hills.sampler().remove_chunk(kBall);
  hills.expect_right_after_two_seconds();
}

TEST(SteeredChanges, AThingThatMovesIsWhereItIs) {
  Hills hills;
  hills.put_ball({-0.15f, 0.14f, 0.1f}, 0xc02020);
  hills.expect_right_after_two_seconds();
}

TEST(SteeredChanges, AThingThatAppearsIsThere) {
  Hills hills;
  hills.sampler().remove_chunk(kBall);
  for (int i = 0; i < kUpdatesInTwoSeconds; ++i) hills.update(walk(++hills.at));
  hills.put_ball({0.1f, 0.14f, 0.1f}, 0x20c020);
  hills.expect_right_after_two_seconds();
}

TEST(SteeredChanges, AThingThatChangesItsColourHasIt) {
  Hills hills;
  hills.put_ball({0.1f, 0.14f, 0.1f}, 0x2020c0);
  hills.expect_right_after_two_seconds();
}

// Real meshes: noisy, rough, thin.
class RealMesh : public testing::TestWithParam<const char*> {};

TEST_P(RealMesh, NothingIsForgottenAlongAWalk) {
  const char* home = std::getenv("HOME");
  const std::string data = std::string(home ? home : "") + "/.cache/telesplat-data/";
  const std::string path = data + "meshes/" + GetParam() + ".ply", movement = data + "trajectories/walk-around-a.csv";
  if (!std::filesystem::exists(path) || !std::filesystem::exists(movement))
    GTEST_SKIP() << path << " or " << movement << " is not there";
  const auto trajectory = geometry::Trajectory::read_csv(movement);
  const auto store = data::open_mesh(path, data::MeshOptions{}, data::Progress{});
  ASSERT_TRUE(trajectory.ok() && store.ok());
  geometry::Box box;
  std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks;
  for (const auto& info : (*store)->leaves()) {
    chunks.emplace_back(info.id, (*store)->chunk(info.id));
    box.extend(info.box_room);
  }
  Session session(box);
  ASSERT_TRUE(session.sampler().add_chunks(std::move(chunks)).ok());
  uint64_t rays = 0;
  constexpr int kUpdates = 50;
  for (int i = 0; i < kUpdates; ++i)
    rays += session.update(geometry::make_camera(trajectory->at(i * Session::kUpdate_s), 90, kWidth, kHeight));
  EXPECT_LT(double(rays), 0.2 * kUpdates * kWidth * kHeight);
  EXPECT_EQ(session.forgotten(), 0u);
}

INSTANTIATE_TEST_SUITE_P(All, RealMesh, testing::Values("alderson-bone-718k", "colorado-5760k", "head-t1-4100k"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::erase_if(name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
                           return name;
                         });

}  // namespace
}  // namespace telesplat::packer
