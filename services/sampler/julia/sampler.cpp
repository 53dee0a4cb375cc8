#include "services/sampler/julia/sampler.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "common/core/check.h"
#include "common/image/normal.h"
#include "common/parallel/in_parallel.h"

namespace telesplat::sampler {

namespace {

// Returns bits x .. x + 7 of a row of bits; bits outside of the row are 0. x: more than -8.
uint8_t eight_bits(const uint64_t* words, size_t count, int x) {
  if (x < 0) return static_cast<uint8_t>(words[0] << -x);
  const size_t word = static_cast<size_t>(x) / 64, shift = static_cast<size_t>(x) % 64;
  if (word >= count) return 0;
  const uint64_t rest = shift > 56 && word + 1 < count ? words[word + 1] << (64 - shift) : 0;
  return static_cast<uint8_t>(words[word] >> shift | rest);
}
// Returns a bit for each of x .. x + 7 that lies in [0, width).
uint8_t eight_inside(int x, int width) {
  const int left = std::max(-x, 0), right = std::min(width - x, 8);
  return left >= right ? 0 : static_cast<uint8_t>((255u << left) & (255u >> (8 - right)));
}

// Returns the wanted rays of blocks [block_begin, block_end) of a row of blocks.
JuliaPart make_part(const JuliaRays& rays, const geometry::Rect& rect, const image::PixelMask* mask, int block_row,
                    int block_begin, int block_end) {
  static_assert(kJuliaBlock == 8);
  JuliaPart part{block_row, block_begin, block_end};
  for (int row = 0; row < kJuliaBlock; ++row) {
    const int y = rays.y0 + block_row * kJuliaBlock + row - rect.y;
    if (y < 0 || y >= rect.height) continue;
    for (int block = block_begin; block < block_end; ++block) {
      const int x = rays.x0 + block * kJuliaBlock - rect.x;
      part.wanted[row][block - block_begin] =
          mask ? eight_bits(mask->row(y), mask->words_per_row(), x) : eight_inside(x, rect.width);
    }
  }
  return part;
}

// Parts of a rectangle that are traced together, one behind the other in a list.
struct Batches {
  std::vector<JuliaPart> parts;
  std::vector<size_t> begin{0};  // first part of each batch, and the end of the last batch
};

// Cuts each row of blocks into one or several parts, so that even a single row of pixels keeps all threads busy. With a
// mask, parts have few rays or none; then several parts make a batch.
Batches make_batches(const JuliaRays& rays, const geometry::Rect& rect, const image::PixelMask* mask) {
  constexpr int kMaskedBatch = 256;  // rays: enough for lanes to be full most of the time
  Batches out;
  int waiting = 0;
  const auto close = [&] {
    if (out.begin.back() < out.parts.size()) out.begin.push_back(out.parts.size());
    waiting = 0;
  };
  for (int row = 0; row < rays.rows_of_blocks; ++row)
    for (int block = 0; block < rays.columns_of_blocks; block += JuliaPart::kBlocks) {
      const int end = std::min(block + JuliaPart::kBlocks, rays.columns_of_blocks);
      const JuliaPart part = make_part(rays, rect, mask, row, block, end);
      const int count = part.rays();
      if (count == 0) continue;
      if (!mask || waiting + count > JuliaPoints::kMost) close();
      out.parts.push_back(part);
      waiting += count;
      if (waiting >= kMaskedBatch) close();
    }
  close();
  return out;
}

// Calls consume(points) for every batch, on several threads at once.
template <class Consume>
void trace_batches(tbb::task_arena& arena, JuliaTrace trace, const JuliaScene& scene, const JuliaRays& rays,
                   const Batches& batches, const Consume& consume) {
  const std::span<const JuliaPart> parts = batches.parts;
  const auto trace_range = [&](const tbb::blocked_range<size_t>& range) {
    const auto points = std::make_unique_for_overwrite<JuliaPoints>();
    for (size_t i = range.begin(); i < range.end(); ++i) {
      points->count = 0;
      trace(scene.constants(), rays, parts.subspan(batches.begin[i], batches.begin[i + 1] - batches.begin[i]), *points);
      consume(*points);
    }
  };
  arena.execute([&] { in_parallel(tbb::blocked_range<size_t>(0, batches.begin.size() - 1), trace_range); });
}

}  // namespace

JuliaSampler::JuliaSampler(int threads, JuliaTrace trace)
    : arena_(threads > 0 ? threads : tbb::task_arena::automatic), trace_(trace) {}

image::DepthImage JuliaSampler::sample(const JuliaScene& scene, const geometry::Camera& camera,
                                       const geometry::Rect& rect, double footprint_px, const image::PixelMask* mask) {
  image::DepthImage out(rect.width, rect.height);
  const JuliaPalette& palette = julia_palette(scene.palette());
  if (rect.width <= 0 || rect.height <= 0) return out;
  const JuliaRays rays(scene, camera, rect, footprint_px);
  trace_batches(arena_, trace_, scene, rays, make_batches(rays, rect, mask), [&](const JuliaPoints& points) {
    for (int i = 0; i < points.count; ++i) {
      const size_t at = size_t(points.y[i] + rays.y0 - rect.y) * rect.width + (points.x[i] + rays.x0 - rect.x);
      out.depth[at] = image::encode_depth(points.depth_m[i], camera.near_m);
      out.colour[at] = palette.rounded(points.tone[i], points.light[i]);
      out.normal[at] = image::encode_normal16({points.normal[0][i], points.normal[1][i], points.normal[2][i]});
    }
  });
  return out;
}

image::View render_julia_directly(const JuliaScene& scene, const geometry::Camera& camera,
                                  const image::Shading& shading, int threads, double footprint_px) {
  const size_t pixels = size_t(camera.width) * camera.height;
  image::View view{camera.width, camera.height, std::vector<uint32_t>(pixels, shading.background()),
                   std::vector<float>(pixels, std::numeric_limits<float>::infinity())};
  const JuliaPalette& palette = julia_palette(scene.palette());
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  const geometry::Rect whole{0, 0, camera.width, camera.height};
  if (pixels == 0) return view;
  const JuliaRays rays(scene, camera, whole, footprint_px);
  trace_batches(arena, julia_trace, scene, rays, make_batches(rays, whole, nullptr), [&](const JuliaPoints& points) {
    for (int i = 0; i < points.count; ++i) {
      const size_t at = size_t(points.y[i] + rays.y0) * camera.width + (points.x[i] + rays.x0);
      const float intensity = shading.intensity({points.normal[0][i], points.normal[1][i], points.normal[2][i]});
      view.colour[at] = palette.rounded(points.tone[i], points.light[i] * intensity);
      view.depth_m[at] = points.depth_m[i];
    }
  });
  return view;
}

namespace {

// In the order of julia::palette_names(): ember, ocean, forest, spectrum, ivory, dusk, copper, ice.
constexpr uint32_t kEmber[] = {0x5a2016, 0x8d2c1c, 0xc24a1e, 0xe98a35, 0xf6cf7a, 0xe9a04a, 0xb8502a, 0x7d2c22};
constexpr uint32_t kOcean[] = {0x2a6f96, 0x2490a0, 0x6cc7b6, 0xd8ecd0, 0x86cdd0, 0x3f8fbc, 0x2a5f98, 0x24547f};
constexpr uint32_t kForest[] = {0x456e3e, 0x6c9447, 0xb5bd62, 0xe8dfa6, 0xb39a5c, 0x8a7a40, 0x5d6a38, 0x3f5f38};
constexpr uint32_t kSpectrum[] = {0xc8504e, 0xd8884a, 0xd6bc56, 0x7fb862, 0x49a89c, 0x4a80c0, 0x7c66b8, 0xb45a92};
constexpr uint32_t kIvory[] = {0xf2ead8, 0xe4d3b4, 0xcdb38c, 0xb0906c, 0x9c7d62, 0xb89d7e, 0xd6c3a2, 0xeadfc8};
constexpr uint32_t kDusk[] = {0x8f5f9c, 0xcb6f86, 0xf0a98a, 0xf4d3ac, 0xb98fae, 0x7a6aa8, 0x5a4f90, 0x6a5298};
constexpr uint32_t kCopper[] = {0x4a2a20, 0x8a4b30, 0xc47a4c, 0xe8b388, 0x9fb8a4, 0x4f8f84, 0x386460, 0x3a4440};
constexpr uint32_t kIce[] = {0xf0f6fa, 0xc6e0f0, 0x8fbfe0, 0x5a93c8, 0x4a6fae, 0x6d86b8, 0xa3b8d4, 0xd6e2ee};

const auto& palettes() {
  static const std::array all{JuliaPalette(kEmber),    JuliaPalette(kOcean), JuliaPalette(kForest),
                              JuliaPalette(kSpectrum), JuliaPalette(kIvory), JuliaPalette(kDusk),
                              JuliaPalette(kCopper),   JuliaPalette(kIce)};
  return all;
}

}  // namespace

JuliaPalette::JuliaPalette(const uint32_t* stops, size_t count) {
  const auto stop = [&](size_t i) {
    const uint32_t c = stops[i % count];
    return glm::vec3(c >> 16 & 255, c >> 8 & 255, c & 255);
  };
  for (int i = 0; i < kEntries; ++i) {
    const float at = static_cast<float>(i) * static_cast<float>(count) / kEntries, f = at - std::floor(at);
    const auto k = static_cast<size_t>(at) + count;
    const glm::vec3 a = stop(k - 1), b = stop(k), c = stop(k + 1), d = stop(k + 2);
    const glm::vec3 curve =
        b + 0.5f * f * ((c - a) + f * ((2.0f * a - 5.0f * b + 4.0f * c - d) + f * (3.0f * (b - c) + d - a)));
    entries_[i] = glm::clamp(curve, 0.0f, 255.0f);
  }
}

const glm::vec3& JuliaPalette::at(float tone) const {
  const float part = tone - std::floor(tone);  // NaN if tone is infinite
  return entries_[part >= 0 && part < 1 ? static_cast<int>(part * kEntries) : 0];
}

const JuliaPalette& julia_palette(int index) {
  CHECK(index >= 0 && index < julia_palette_count());
  return palettes()[static_cast<size_t>(index)];
}

int julia_palette_count() { return static_cast<int>(palettes().size()); }

}  // namespace telesplat::sampler
