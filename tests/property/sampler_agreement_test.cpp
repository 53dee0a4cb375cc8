// Rays = raster: both samplers show the same surface, up to the edges of triangles; and their samples lie on the mesh.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <random>
#include <set>

#include "common/geometry/trajectory.h"
#include "services/sampler/mesh/sampler.h"
#include "tests/support/mesh_chunks.h"

namespace telesplat::sampler {
namespace {

using geometry::Camera;
using image::DepthImage;

// Triangles of all sizes and directions around the origin, with normals that agree with their planes, in 4 chunks.
test::ChunkList random_triangles(uint32_t seed, int count) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  const auto vector = [&] { return glm::vec3(unit(random), unit(random), unit(random)); };
  test::ChunkList chunks;
  for (int part = 0; part < 4; ++part) {
    std::vector<test::Vertex> vertices;
    std::vector<uint32_t> indices;
    for (int i = 0; i < count / 4; ++i) {
      const glm::vec3 a = 0.4f * vector(), b = a + 0.2f * vector(), c = a + 0.2f * vector();
      const glm::vec3 n = glm::normalize(glm::cross(b - a, c - a));
      for (const glm::vec3& p : {a, b, c}) {
        indices.push_back(uint32_t(vertices.size()));
        vertices.push_back({p, n + 0.1f * vector(), static_cast<uint32_t>(random() & 0xffffff)});
      }
    }
    chunks.emplace_back(ChunkId{uint64_t(part)}, test::chunk_of(vertices, indices));
  }
  return chunks;
}

std::vector<Camera> cameras(uint32_t seed, int count) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Camera> out;
  for (int i = 0; i < count; ++i) {
    const glm::dvec3 direction = glm::normalize(glm::dvec3(unit(random), unit(random), unit(random)));
    const auto pose = geometry::look_at(direction * (0.5 + 0.4 * (unit(random) + 1)),
                                        0.1 * glm::dvec3(unit(random), unit(random), 0));
    Camera c = geometry::make_camera(pose, 50 + 30 * (unit(random) + 1), 320, 200, i % 2 ? 0.02 : 0.1);
    if (i % 3 == 2) c.left -= 0.4, c.right -= 0.1, c.top += 0.2;  // off axis
    out.push_back(c);
  }
  return out;
}

struct Difference {
  size_t covered = 0, coverage = 0, depth = 0, colour = 0, normal = 0;
};

int channel_distance(uint32_t a, uint32_t b) {
  int d = 0;
  for (int shift : {0, 8, 16}) d = std::max(d, std::abs(int(a >> shift & 255) - int(b >> shift & 255)));
  return d;
}

Difference compare(const DepthImage& a, const DepthImage& b, int64_t codes = 8) {
  Difference d;
  for (size_t i = 0; i < a.pixels(); ++i) {
    if (a.depth[i] == 0 && b.depth[i] == 0) continue;
    ++d.covered;
    if ((a.depth[i] == 0) != (b.depth[i] == 0)) {
      ++d.coverage;
      continue;
    }
    d.depth += std::abs(int64_t(a.depth[i]) - int64_t(b.depth[i])) > codes;
    d.colour += channel_distance(a.colour[i], b.colour[i]) > 1;
    d.normal += glm::dot(image::decode_normal16(a.normal[i]), image::decode_normal16(b.normal[i])) < 0.999f;
  }
  return d;
}

class RaysAndRaster : public testing::Test {
 protected:
  void SetUp() override {
    auto made = make_raster_sampler();
    if (!made) GTEST_SKIP() << made.error().text;
    raster_ = std::move(*made);
  }
  void load(const test::ChunkList& chunks) {
    ASSERT_TRUE(ray_->add_chunks(chunks).ok());
    ASSERT_TRUE(raster_->add_chunks(chunks).ok());
  }
  // Sums differences over cameras; `allowed`: share of covered pixels that may differ: those that edges cross. codes:
  // depth codes that count as equal.
  void expect_agreement(const std::vector<Camera>& views, double allowed, int64_t codes = 8) {
    Difference sum;
    for (const Camera& c : views) {
      const geometry::Rect whole{0, 0, c.width, c.height};
      const Difference d = compare(ray_->sample(c, whole), raster_->sample(c, whole), codes);
      sum.covered += d.covered, sum.coverage += d.coverage, sum.depth += d.depth, sum.colour += d.colour,
          sum.normal += d.normal;
    }
    RecordProperty("covered", int(sum.covered));
    ASSERT_GT(sum.covered, views.size() * 320 * 200 / 10);
    const double limit = allowed * static_cast<double>(sum.covered);
    EXPECT_LE(sum.coverage, limit);
    EXPECT_LE(sum.depth, limit);
    EXPECT_LE(sum.colour, limit);
    EXPECT_LE(sum.normal, limit);
  }
  std::unique_ptr<Sampler> ray_ = make_ray_sampler(2), raster_;
};

TEST_F(RaysAndRaster, AgreeOnRandomTriangles) {
  for (uint32_t seed = 1; seed <= 4; ++seed) {
    load(random_triangles(seed, 60));  // replaces the chunks of the seed before
    expect_agreement(cameras(seed, 6), 1e-3);
  }
}

TEST_F(RaysAndRaster, AgreeOnATerrainOfSmallTriangles) {
  load(test::terrain(200, 60));
  expect_agreement(cameras(9, 8), 1e-3);
}

// Returns a scalar at each vertex, one in a hundred missing.
test::ChunkList with_scalars(const test::ChunkList& chunks) {
  test::ChunkList out;
  for (const auto& [id, chunk] : chunks) {
    const auto held = geometry::decode_chunk(chunk.bytes);
    const auto* view = &held->view;
    std::vector<uint32_t> scalars;
    for (size_t v = 0; v < view->vertices(); ++v) {
      const float value = 100 * view->positions_room[3 * v] + 40 * view->positions_room[3 * v + 2];
      scalars.push_back(std::bit_cast<uint32_t>(v % 100 == 7 ? std::numeric_limits<float>::quiet_NaN() : value));
    }
    out.emplace_back(
        id, test::coded(geometry::build_chunk(view->positions_room, view->normals, scalars, view->indices, true)));
  }
  return out;
}

TEST_F(RaysAndRaster, AgreeOnScalarsAndTheirMissingValues) {
  const scene::Colouring colouring{"heat", "", -30, 35, 0, *colour::find_colour_map("viridis")};
  const auto table = std::make_shared<const scene::ColourTable>(scene::make_table(colouring));
  load(with_scalars(test::terrain(200, 60)));
  const Camera c = cameras(9, 1)[0];
  const geometry::Rect whole{0, 0, c.width, c.height};
  for (Sampler* sampler : {ray_.get(), raster_.get()}) {
    for (const uint32_t colour : sampler->sample(c, whole).colour)  // before set_colours()
      ASSERT_TRUE(colour == 0 || colour == 0xc8c8c8);
    sampler->set_colours(table);
  }
  expect_agreement(cameras(9, 8), 1e-3);
  const DepthImage image = ray_->sample(c, whole);
  size_t missing = 0, covered = 0;
  for (size_t i = 0; i < image.pixels(); ++i) {
    missing += image.colour[i] == colouring.map.missing;
    covered += image.depth[i] != 0;
  }
  EXPECT_GT(missing, covered / 100);
  EXPECT_LT(missing, covered / 4);
  EXPECT_GT(std::set<uint32_t>(image.colour.begin(), image.colour.end()).size(), 200u);
}

TEST_F(RaysAndRaster, AgreeInsideTheSceneWhereTheNearPlaneCuts) {
  load(random_triangles(11, 200));
  std::vector<Camera> views;
  for (int i = 0; i < 4; ++i)
    views.push_back(geometry::make_camera(geometry::look_at({0.05 * i, 0.02, 0}, {1, 0.1 * i, 1}), 90, 320, 200, 0.05));
  // A near triangle seen from its edge: rounding counts a hundred times.
  expect_agreement(views, 3e-3, 64);
}

TEST_F(RaysAndRaster, RasterTilesAreThePartsOfItsFrame) {
  load(test::terrain(100, 40));
  const Camera c = cameras(5, 1)[0];
  const DepthImage frame = raster_->sample(c, {0, 0, c.width, c.height});
  DepthImage assembled(c.width, c.height);
  for (int y = 0; y < c.height; y += 40)
    for (int x = 0; x < c.width; x += 64) {
      const DepthImage part = raster_->sample(c, {x, y, 64, 40});
      for (int row = 0; row < 40; ++row)
        for (int column = 0; column < 64; ++column) {
          const size_t from = size_t(row) * 64 + column, to = size_t(y + row) * c.width + x + column;
          assembled.depth[to] = part.depth[from], assembled.colour[to] = part.colour[from],
          assembled.normal[to] = part.normal[from];
        }
    }
  const Difference d = compare(frame, assembled);
  ASSERT_GT(d.covered, 5000u);
  EXPECT_LE(d.coverage + d.depth + d.colour + d.normal, d.covered / 250);
}

TEST_F(RaysAndRaster, RasterRemovesAndRefusesChunksToo) {
  const Camera c = cameras(5, 1)[0];
  const geometry::Rect whole{0, 0, c.width, c.height};
  EXPECT_EQ(raster_->sample(c, whole), DepthImage(c.width, c.height));
  load(random_triangles(3, 40));
  const std::vector<std::byte> garbage(256, std::byte{1});
  EXPECT_FALSE(raster_->add_chunk({0}, {garbage, nullptr}).ok());
  EXPECT_NE(raster_->sample(c, whole), DepthImage(c.width, c.height));
  for (uint64_t id = 0; id < 4; ++id) raster_->remove_chunk({id});
  EXPECT_EQ(raster_->sample(c, whole), DepthImage(c.width, c.height));
}

// An unprojected sample lies on one of the triangles' planes, within depth quantisation and single precision.
TEST(SampledPoints, LieOnTheMeshAndInFrontOfNothing) {
  for (uint32_t seed = 1; seed <= 3; ++seed) {
    const auto chunks = random_triangles(seed, 24);
    auto ray = make_ray_sampler(2);
    ASSERT_TRUE(ray->add_chunks(chunks).ok());
    struct Triangle {
      glm::dvec3 a, e1, e2;
    };
    std::vector<Triangle> triangles;
    for (const auto& [id, chunk] : chunks) {
      const auto held = geometry::decode_chunk(chunk.bytes);
      ASSERT_TRUE(held.ok());
      const auto* view = &held->view;
      const auto at = [&](uint32_t i) {
        const float* p = &view->positions_room[3 * size_t{i}];
        return glm::dvec3(p[0], p[1], p[2]);
      };
      for (size_t t = 0; t < view->triangles(); ++t) {
        const glm::dvec3 a = at(view->indices[3 * t]);
        triangles.push_back({a, at(view->indices[3 * t + 1]) - a, at(view->indices[3 * t + 2]) - a});
      }
    }
    for (Camera c : cameras(seed, 4)) {
      c.width = 80, c.height = 50;
      const DepthImage image = ray->sample(c, {0, 0, c.width, c.height});
      for (int y = 0; y < c.height; ++y)
        for (int x = 0; x < c.width; ++x) {
          // Brute force in double precision: the nearest triangle on this pixel's ray.
          const glm::dvec3 o = c.pose.position_room, d = c.unproject(x + 0.5, y + 0.5, 1.0) - o;
          double nearest = INFINITY;
          bool near_an_edge = false;
          for (const Triangle& t : triangles) {
            const glm::dvec3 g = glm::cross(t.e1, t.e2), r = glm::cross(t.a - o, d);
            const double total = glm::dot(d, g), u = glm::dot(r, t.e2) / total, v = -glm::dot(r, t.e1) / total;
            const double depth = glm::dot(t.a - o, g) / total, inside = std::min({u, v, 1 - u - v});
            if (std::abs(inside) < 1e-3 || std::abs(depth - c.near_m) < 1e-5) near_an_edge = true;
            if (inside > 0 && depth >= c.near_m) nearest = std::min(nearest, depth);
          }
          if (near_an_edge) continue;
          const uint32_t code = image.depth[size_t(y) * c.width + x];
          ASSERT_EQ(code != 0, std::isfinite(nearest)) << "seed " << seed << " pixel " << x << "," << y;
          if (code == 0) continue;
          const double depth = image::decode_depth(code, c.near_m),
                       step = nearest * nearest / (c.near_m * image::kMaxDepthCode);
          // Half a code, and the slope of the triangle times the error of ray and corners in single precision.
          EXPECT_NEAR(depth, nearest, step + 2e-5 * nearest) << "seed " << seed << " pixel " << x << "," << y;
          EXPECT_LT(glm::length(c.unproject(x + 0.5, y + 0.5, depth) - (o + d * nearest)), 2 * (step + 2e-5 * nearest));
        }
    }
  }
}

}  // namespace
}  // namespace telesplat::sampler
