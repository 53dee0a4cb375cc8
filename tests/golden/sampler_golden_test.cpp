// Compares the samplers' pictures of a small analytic mesh (a tessellated torus over a chequered floor) with committed
// ones: direct rendering, and a depth image's planes as colours. A failing case leaves reference, rendered and
// difference pictures in the build folder (golden-failures/). To accept new pictures, look at them and run with
// TELESPLAT_UPDATE_GOLDEN=1.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "common/geometry/trajectory.h"
#include "services/sampler/mesh/sampler.h"
#include "tests/support/mesh_chunks.h"

namespace telesplat::sampler {
namespace {

constexpr int kWidth = 192, kHeight = 120;
const char* const kFolder = "tests/golden/images/";

test::ChunkList scene() {
  constexpr int kAround = 96, kAcross = 32;
  constexpr float kTurn = 6.2831853f;
  std::vector<test::Vertex> vertices;
  std::vector<uint32_t> indices;
  const auto quad = [&](uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    indices.insert(indices.end(), {a, b, c, a, c, d});
  };
  for (int i = 0; i <= kAround; ++i)
    for (int k = 0; k <= kAcross; ++k) {
      const float s = kTurn * i / kAround, t = kTurn * k / kAcross;
      const glm::vec3 n(std::cos(s) * std::cos(t), std::sin(t), std::sin(s) * std::cos(t));
      const glm::vec3 ring(0.24f * std::cos(s), 0.03f, 0.24f * std::sin(s));
      vertices.push_back({ring + 0.09f * n, n, std::abs(std::sin(3 * s)) > 0.5f ? 0xd04030u : 0xf0d060u});
    }
  for (uint32_t i = 0; i < kAround; ++i)
    for (uint32_t k = 0; k < kAcross; ++k) {
      const uint32_t a = i * (kAcross + 1) + k;
      quad(a, a + 1, a + kAcross + 2, a + kAcross + 1);
    }
  test::ChunkList chunks;
  chunks.emplace_back(ChunkId{0}, test::chunk_of(vertices, indices));

  vertices.clear(), indices.clear();
  for (int z = -8; z < 8; ++z)
    for (int x = -8; x < 8; ++x) {
      const uint32_t colour = (x + z) & 1 ? 0xc8c0b0 : 0x405060, first = uint32_t(vertices.size());
      for (const auto& [dx, dz] : {std::pair{0, 0}, {0, 1}, {1, 1}, {1, 0}})
        vertices.push_back({{0.05f * float(x + dx), -0.12f, 0.05f * float(z + dz)}, {0, 1, 0}, colour});
      quad(first, first + 1, first + 2, first + 3);
    }
  chunks.emplace_back(ChunkId{1}, test::chunk_of(vertices, indices));
  return chunks;
}

geometry::Camera camera() {
  geometry::Camera c = geometry::make_camera(geometry::look_at({0.35, 0.33, 0.4}, {0, -0.03, 0}), 80, kWidth, kHeight);
  c.left -= 0.1, c.right -= 0.1;  // off axis
  return c;
}

// Depth bits 12 to 19 in red, the normal code in green and blue.
image::View planes(const image::DepthImage& image) {
  image::View out{image.width, image.height, std::vector<uint32_t>(image.pixels()), {}};
  for (size_t i = 0; i < image.pixels(); ++i)
    if (image.depth[i] != 0) out.colour[i] = (image.depth[i] >> 12 & 255) << 16 | image.normal[i];
  return out;
}
image::View albedo(const image::DepthImage& image) { return {image.width, image.height, image.colour, {}}; }

// Another processor's rounding may move an edge to the next pixel: few pixels may differ by much, and the others by a
// step of quantisation.
void expect_golden(const std::string& name, const image::View& rendered, size_t allowed_pixels) {
  const std::string path = kFolder + name + ".png";
  if (std::getenv("TELESPLAT_UPDATE_GOLDEN")) {
    ASSERT_TRUE(image::write_png(path, rendered).ok());
  }
  const auto reference = image::read_view(path);
  ASSERT_TRUE(reference.ok()) << reference.error().text;
  ASSERT_EQ(reference->colour.size(), rendered.colour.size());
  image::View difference{kWidth, kHeight, std::vector<uint32_t>(rendered.colour.size()), {}};
  size_t different = 0;
  double sum = 0;
  for (size_t i = 0; i < rendered.colour.size(); ++i) {
    int largest = 0;
    for (int shift : {16, 8, 0}) {
      const int d = std::abs(int(rendered.colour[i] >> shift & 255) - int(reference->colour[i] >> shift & 255));
      difference.colour[i] |= uint32_t(std::min(255, 4 * d)) << shift;
      largest = std::max(largest, d);
      sum += d;
    }
    different += largest > 1;
  }
  const double mean = sum / (3.0 * double(rendered.colour.size()));
  EXPECT_LE(different, allowed_pixels) << name;
  EXPECT_LE(mean, 0.05) << name;
  if (different <= allowed_pixels && mean <= 0.05) return;
  const std::filesystem::path folder = std::filesystem::path(TELESPLAT_GOLDEN_OUT) / "golden-failures";
  std::filesystem::create_directories(folder);
  for (const auto& [what, view] :
       {std::pair{"reference", &*reference}, {"rendered", &rendered}, {"difference", &difference}})
    EXPECT_TRUE(image::write_png((folder / (name + "-" + what + ".png")).string(), *view).ok());
}

TEST(SamplerGolden, DirectRendering) {
  auto sampler = make_ray_sampler(2);
  ASSERT_TRUE(sampler->add_chunks(scene()).ok());
  expect_golden("sampler-direct", render_directly(*sampler, camera(), image::Shading({}, camera())), 8);
}

TEST(SamplerGolden, RaySamplersDepthImage) {
  auto sampler = make_ray_sampler(2);
  ASSERT_TRUE(sampler->add_chunks(scene()).ok());
  const image::DepthImage image = sampler->sample(camera(), {0, 0, kWidth, kHeight});
  expect_golden("sampler-planes", planes(image), 8);
  expect_golden("sampler-albedo", albedo(image), 8);
}

TEST(SamplerGolden, RasterSamplersDepthImage) {
  auto sampler = make_raster_sampler();
  if (!sampler) GTEST_SKIP() << sampler.error().text;
  ASSERT_TRUE((*sampler)->add_chunks(scene()).ok());
  const image::DepthImage image = (*sampler)->sample(camera(), {0, 0, kWidth, kHeight});
  expect_golden("sampler-planes", planes(image), 60);  // the rasteriser decides edges on a grid of its own
  expect_golden("sampler-albedo", albedo(image), 60);
}

}  // namespace
}  // namespace telesplat::sampler
