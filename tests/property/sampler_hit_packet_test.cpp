// The SIMD attribute kernel against its scalar oracle, on every instruction set this processor has.
#include <gtest/gtest.h>

#include <hwy/targets.h>

#include <bit>
#include <limits>
#include <random>

#include "services/sampler/mesh/hit_packet.h"
#include "services/sampler/mesh/sampler.h"
#include "tests/support/mesh_chunks.h"

namespace telesplat::sampler {
namespace {

// Runs `body` once for each SIMD target, with the others switched off.
template <class Body>
void for_each_target(const Body& body) {
  for (int64_t rest = hwy::SupportedTargets(); rest != 0; rest &= rest - 1) {
    const int64_t target = rest & -rest;
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    SCOPED_TRACE(hwy::TargetName(target));
    body();
    hwy::SetSupportedTargetsForTest(0);
  }
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST(HitPacket, SimdEqualsScalarOnEveryTarget) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(-1, 1), weight(0, 1);
  const auto vector = [&] { return glm::vec3(unit(random), unit(random), unit(random)); };
  std::vector<test::Vertex> vertices;
  std::vector<uint32_t> indices;
  for (uint32_t i = 0; i < 3000; ++i) {
    vertices.push_back({vector(), vector(), static_cast<uint32_t>(random() & 0xffffff)});
    indices.push_back(i);
  }
  // Axis-aligned normals sit on the folds of the octahedron.
  for (uint32_t i = 0; i < 300; ++i)
    vertices[i].normal = glm::vec3(i % 3 == 0, i % 3 == 1, i % 3 == 2) * (i % 2 ? 1.0f : -1.0f);
  const auto chunk = test::chunk_of(vertices, indices);
  const auto held = geometry::decode_chunk(chunk.bytes);
  ASSERT_TRUE(held.ok());
  const auto* view = &held->view;

  for_each_target([&] {
    for (uint32_t first = 0; first < 1000; first += kPacket) {
      HitPacket hits{};
      glm::vec3 g[kPacket], d[kPacket];
      for (int k = 0; k < kPacket; ++k) {
        hits.u[k] = weight(random);
        hits.v[k] = (1 - hits.u[k]) * weight(random);
        g[k] = vector(), d[k] = vector();
        for (int a = 0; a < 3; ++a) hits.geometric_normal[a][k] = g[k][a], hits.direction[a][k] = d[k][a];
        for (int c = 0; c < 3; ++c) {
          hits.corner_normal[c][k] = view->normals[3 * (first + k) + c];
          hits.corner_colour[c][k] = view->colours[3 * (first + k) + c];
        }
      }
      alignas(32) uint32_t colour[kPacket], normal[kPacket];
      shade_hits(hits, colour, normal);
      for (int k = 0; k < kPacket; ++k) {
        const SurfacePoint expected =
            surface_point(*view, first + k, {hits.u[k], hits.v[k]}, g[k], d[k], *neutral_colours());
        EXPECT_NEAR(colour[k] >> 16, expected.colour.x, 0.501);
        EXPECT_NEAR(colour[k] >> 8 & 255, expected.colour.y, 0.501);
        EXPECT_NEAR(colour[k] & 255, expected.colour.z, 0.501);
        ASSERT_LT(normal[k], 65536u);
        const glm::vec3 n = image::decode_normal16(static_cast<uint16_t>(normal[k]));
        EXPECT_GT(glm::dot(n, expected.normal), std::cos(0.018f)) << "triangle " << first + k;  // one degree
        EXPECT_LT(glm::dot(n, glm::normalize(d[k])), 0.018f) << "faces away";
      }
    }
  });
}

TEST(HitPacket, ScalarsAreLookedUpOnEveryTarget) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> value(-2, 12), weight(0, 1);
  const scene::ColourTable table = scene::make_table({"heat", "", 0, 10, 0, *colour::find_colour_map("viridis")});
  std::vector<test::Vertex> vertices;
  std::vector<uint32_t> indices;
  for (uint32_t i = 0; i < 600; ++i) {
    const float scalar = i % 50 == 3 ? std::numeric_limits<float>::quiet_NaN() : value(random);
    vertices.push_back({{float(i), float(i % 7), float(i % 3)}, {0, 0, 1}, std::bit_cast<uint32_t>(scalar)});
    indices.push_back(i);
  }
  const auto chunk = test::chunk_of(vertices, indices, true);
  const auto held = geometry::decode_chunk(chunk.bytes);
  ASSERT_TRUE(held.ok());
  const auto* view = &held->view;
  ASSERT_TRUE(view->scalars);
  for_each_target([&] {
    for (uint32_t first = 0; first < 200; first += kPacket) {
      HitPacket hits{};
      for (int k = 0; k < kPacket; ++k) {
        hits.u[k] = weight(random);
        hits.v[k] = (1 - hits.u[k]) * weight(random);
        hits.geometric_normal[2][k] = 1, hits.direction[2][k] = -1;
        for (int c = 0; c < 3; ++c) {
          hits.corner_normal[c][k] = view->normals[3 * (first + k) + c];
          hits.corner_colour[c][k] = view->colours[3 * (first + k) + c];
        }
      }
      alignas(32) uint32_t colour[kPacket], normal[kPacket];
      shade_hits(hits, colour, normal, &table);
      for (int k = 0; k < kPacket; ++k) {
        const SurfacePoint expected =
            surface_point(*view, first + k, {hits.u[k], hits.v[k]}, {0, 0, 1}, {0, 0, -1}, table);
        for (int channel = 0; channel < 3; ++channel)  // neighbours in the table differ by one
          EXPECT_NEAR(colour[k] >> (16 - 8 * channel) & 255, expected.colour[channel], 1.01);
      }
    }
  });
}

}  // namespace
}  // namespace telesplat::sampler
