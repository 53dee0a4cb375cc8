// Packing: costs of a sampled frame of 1280x800 for the packer and for each viewer, in tiles of 256x256.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstring>
#include <map>

#include "common/points/point_model.h"
#include "common/points/unproject.h"
#include "tests/support/points_scenes.h"

namespace telesplat {
namespace {

struct Tile {
  geometry::Rect rect;
  image::DepthImage image;
};

struct Frame {
  points::ModelConfig config = test::scene_config();
  geometry::Camera camera =
      geometry::make_camera(geometry::look_at({0.05, 0.55, 0.05}, {0.0, -0.29, 0.0}), 50, 1280, 800);
  std::vector<Tile> tiles;
  uint64_t samples = 0;

  explicit Frame(double fraction) {
    for (int y = 0; y < camera.height; y += 256) {
      for (int x = 0; x < camera.width; x += 256) {
        const geometry::Rect rect{x, y, std::min(256, camera.width - x), std::min(256, camera.height - y)};
        tiles.push_back({rect, test::sample_scene(camera, rect)});
        if (fraction < 1) test::mask_randomly(tiles.back().image, fraction, 1 + tiles.size());
        for (const uint32_t d : tiles.back().image.depth) samples += d != 0;
      }
    }
  }
};

const Frame& frame(int percent) {
  static std::map<int, Frame> frames;
  return frames.try_emplace(percent, percent / 100.0).first->second;
}

void finish(benchmark::State& state, uint64_t samples) {
  state.counters["points"] = static_cast<double>(samples);
  state.counters["per_point"] = benchmark::Counter(
      static_cast<double>(samples), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

// Argument: percent of the samples that redundancy elimination left.
void points_prepare(benchmark::State& state) {
  const Frame& f = frame(static_cast<int>(state.range(0)));
  for (auto _ : state)
    for (const Tile& t : f.tiles)
      benchmark::DoNotOptimize(points::prepare_patch(f.config, {1}, f.camera, t.rect, t.image));
  finish(state, f.samples);
}
BENCHMARK(points_prepare)->Arg(100)->Arg(20)->Arg(1)->Unit(benchmark::kMillisecond);

// Baseline: the obvious way: unproject each sample, sort the points by leaf, copy them leaf by leaf. Level 0 only, no
// attributes.
void points_baseline_std_sort(benchmark::State& state) {
  struct Point {
    points::ClusterKey key;
    uint16_t x, y, z, normal;
    uint32_t colour;
  };
  const Frame& f = frame(static_cast<int>(state.range(0)));
  const points::OctreeGrid grid = points::octree_grid(f.config);
  for (auto _ : state) {
    for (const Tile& t : f.tiles) {
      std::vector<Point> all;
      for (int row = 0; row < t.rect.height; ++row) {
        for (int column = 0; column < t.rect.width; ++column) {
          const size_t i = static_cast<size_t>(row) * t.rect.width + column;
          if (t.image.depth[i] == 0) continue;
          const double depth = image::decode_depth(t.image.depth[i], f.camera.near_m);
          const glm::dvec3 p = f.camera.unproject(t.rect.x + column + 0.5, t.rect.y + row + 0.5, depth);
          const glm::uvec3 q((p - grid.lo) * (65536 / grid.leaf_size));
          all.push_back({q.x >> 16 | q.y >> 16 << 10 | q.z >> 16 << 20, static_cast<uint16_t>(q.x),
                         static_cast<uint16_t>(q.y), static_cast<uint16_t>(q.z), t.image.normal[i], t.image.colour[i]});
        }
      }
      std::sort(all.begin(), all.end(), [](const Point& a, const Point& b) { return a.key < b.key; });
      std::vector<std::vector<Point>> leaves;
      for (size_t i = 0, j = 0; i < all.size(); i = j) {
        while (j < all.size() && all[j].key == all[i].key) ++j;
        leaves.emplace_back(all.begin() + static_cast<ptrdiff_t>(i), all.begin() + static_cast<ptrdiff_t>(j));
      }
      benchmark::DoNotOptimize(leaves);
    }
  }
  finish(state, f.samples);
}
BENCHMARK(points_baseline_std_sort)->Arg(100)->Arg(20)->Arg(1)->Unit(benchmark::kMillisecond);

// Baseline: the points' bytes, moved once.
void points_baseline_memcpy(benchmark::State& state) {
  const Frame& f = frame(100);
  std::vector<std::byte> from(f.samples * 13), to(f.samples * 13);
  for (auto _ : state) {
    std::memcpy(to.data(), from.data(), from.size());
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
  }
  finish(state, f.samples);
}
BENCHMARK(points_baseline_memcpy)->Unit(benchmark::kMillisecond);

template <auto kUnproject>
void points_unproject(benchmark::State& state) {
  const Frame& f = frame(100);
  const points::OctreeGrid grid = points::octree_grid(f.config);
  std::vector<points::ClusterKey> keys(256);
  std::vector<uint16_t> x(256), y(256), z(256);
  for (auto _ : state)
    for (const Tile& t : f.tiles)
      for (int row = 0; row < t.rect.height; ++row)
        kUnproject(points::row_rays(grid, f.camera, t.rect.x, t.rect.y + row),
                   &t.image.depth[static_cast<size_t>(row) * t.rect.width], static_cast<size_t>(t.rect.width),
                   keys.data(), {x.data(), y.data(), z.data()});
  benchmark::DoNotOptimize(keys.data());
  finish(state, f.samples);
}
BENCHMARK(points_unproject<points::unproject_row>)->Name("points_unproject_simd")->Unit(benchmark::kMillisecond);
BENCHMARK(points_unproject<points::unproject_row_scalar>)
    ->Name("points_unproject_scalar")
    ->Unit(benchmark::kMillisecond);

// Inserting a prepared frame into a model of 20 earlier frames of 1 %. Arguments: percent of the samples that
// elimination left; 1: mosaics are merged (which viewers do without their lock), 0: they stay as they come, the
// baseline.
void points_insert(benchmark::State& state) {
  const Frame& f = frame(static_cast<int>(state.range(0)));
  points::ModelConfig config = f.config;
  config.compact = state.range(1) != 0;
  points::PointModel model(config);
  uint64_t sequence = 0;
  for (int i = 0; i < 20; ++i)
    for (const Tile& t : frame(1).tiles)
      model.insert(points::prepare_patch(config, {++sequence}, f.camera, t.rect, t.image));
  for (auto _ : state) {
    state.PauseTiming();
    std::vector<points::PreparedPatch> patches;
    for (const Tile& t : f.tiles)
      patches.push_back(points::prepare_patch(config, {++sequence}, f.camera, t.rect, t.image));
    state.ResumeTiming();
    for (auto& patch : patches) model.insert(std::move(patch));
  }
  finish(state, f.samples);
  size_t mosaics = 0;
  for (const auto& [key, cluster] : model.clusters()) mosaics += cluster->mosaics.size();
  state.counters["bytes_point"] = static_cast<double>(model.bytes()) / static_cast<double>(model.points());
  state.counters["mosaics"] = static_cast<double>(mosaics);
}
BENCHMARK(points_insert)
    ->ArgNames({"per_cent", "merged"})
    ->ArgsProduct({{100, 1}, {0, 1}})
    ->Iterations(50)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace telesplat
