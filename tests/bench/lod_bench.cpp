// lod/*: changes in the picture by the level of detail while the head moves. Frames are splatted from one fixed model,
// so that only the view changes.
//   switching: difference between two pictures from the same pose: one with the levels chosen for it, one with those
//     chosen for the frame before. Mean over pixels and channels in 8-bit steps; movement and aliasing are in neither.
//   pops: blocks of 20 x 20 pixels whose switching exceeds 4 steps in a frame.
//   flicker: mean of |error now - error one frame before|, error = picture - direct rendering from the same pose.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "client/viewer/coupling/frame_budget.h"
#include "common/geometry/trajectory.h"
#include "common/image/measures/quality.h"
#include "common/splat/cpu_splatter.h"
#include "services/packer/points/packer_core.h"
#include "services/sampler/mesh/sampler.h"
#include "tests/support/mesh_chunks.h"

namespace telesplat {
namespace {

constexpr int kWidth = 640, kHeight = 400;
constexpr double kFrameRate_hz = 60;
constexpr int kBlock = 20;

geometry::Camera camera_at(const geometry::Pose& pose) { return geometry::make_camera(pose, 90, kWidth, kHeight); }

// 0: away from the surface and back, each frame's distance is the last one's times the same factor. 1: a recorded head
// movement, leaning in and out.
std::vector<geometry::Camera> movement(int which) {
  std::vector<geometry::Camera> out;
  if (which == 0) {
    for (int i = 0; i < 240; ++i) {
      const double distance = 0.22 * std::pow(5.0, 0.5 - 0.5 * std::cos(i / 240.0 * 6.283185307));
      out.push_back(camera_at(geometry::look_at(glm::dvec3(0.3, 0.8, 0.5) * distance, {0, 0, 0})));
    }
    return out;
  }
  const char* data = std::getenv("TELESPLAT_DATA");
  const char* home = std::getenv("HOME");
  const std::string folder = data ? data : std::string(home ? home : "") + "/.cache/telesplat-data";
  const auto recorded = geometry::Trajectory::read_csv(folder + "/trajectories/look-closely-a.csv");
  if (!recorded) return out;
  for (int i = 0; i < std::min(600, static_cast<int>(recorded->duration_s() * kFrameRate_hz)); ++i)
    out.push_back(camera_at(recorded->at(i / kFrameRate_hz)));
  return out;
}

struct Moving {
  std::vector<geometry::Camera> cameras;
  std::vector<image::View> direct;
  std::unique_ptr<packer::PackerCore> packer;
};

const Moving& moving(int which) {
  static Moving cache[2];
  Moving& m = cache[which];
  if (m.packer) return m;
  m.cameras = movement(which);
  packer::Config config;
  config.model = {{{-0.4f, -0.3f, -0.4f}, {0.4f, 0.3f, 0.4f}}, 6};
  m.packer = std::make_unique<packer::PackerCore>(config, EpochId{1});
  const auto sampler = sampler::make_ray_sampler(0);
  CHECK(sampler->add_chunks(test::terrain(362, 181)).ok());
  for (size_t i = 0; i < m.cameras.size(); ++i) {
    const geometry::Camera& camera = m.cameras[i];
    m.direct.push_back(sampler::render_directly(*sampler, camera, image::Shading({}, camera)));
    if (i % 30 != 0) continue;
    const geometry::Rect all{0, 0, kWidth, kHeight};
    packer::SampledTile tile{{.frame = {i + 1}, .epoch = {1}, .tiles_in_frame = 1, .camera = camera, .rect = all},
                             sampler->sample(camera, all)};
    CHECK(m.packer->submit(std::move(tile), 0).ok());
  }
  return m;
}

struct Changes {
  std::vector<double> values;
  double quantile(double q) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[static_cast<size_t>(q * static_cast<double>(values.size() - 1))];
  }
};

using Blocks = std::vector<double>;  // one value a block, row-major

// The mean of each block over pixels and channels of |(a - b) - (c - d)|; b and d may be null.
Blocks differences(const image::View& a, const image::View* b, const image::View& c, const image::View* d) {
  Blocks out(size_t{kWidth / kBlock} * (kHeight / kBlock));
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const size_t i = static_cast<size_t>(y) * kWidth + x;
      int sum = 0;
      for (int shift = 0; shift < 24; shift += 8) {
        const auto channel = [&](const image::View* v) {
          return v ? static_cast<int>(v->colour[i] >> shift & 255) : 0;
        };
        sum += std::abs((channel(&a) - channel(b)) - (channel(&c) - channel(d)));
      }
      out[static_cast<size_t>(y / kBlock * (kWidth / kBlock) + x / kBlock)] += sum / (3.0 * kBlock * kBlock);
    }
  return out;
}

double mean(const Blocks& v) { return std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size()); }

// Counts blocks whose value exceeds 4 steps, except those at the border: the frame before did not choose levels for a
// place that comes into view.
size_t count_pops(const Blocks& blocks) {
  constexpr size_t kColumns = kWidth / kBlock, kRows = kHeight / kBlock;
  size_t pops = 0;
  for (size_t row = 2; row + 2 < kRows; ++row)
    for (size_t column = 2; column + 2 < kColumns; ++column) pops += blocks[row * kColumns + column] > 4.0;
  return pops;
}

void lod_transitions(benchmark::State& state) {
  const Moving& m = moving(static_cast<int>(state.range(1)));
  if (m.cameras.empty()) return state.SkipWithError("look-closely-a.csv is not there (set TELESPLAT_DATA)");
  splat::SelectionOptions options;
  options.transitions = state.range(0) != 0;
  options.scale = 1.5f;
  splat::CpuSplatter splatter;
  const auto frames = static_cast<double>(m.cameras.size());
  Changes flicker, switching, points;
  double psnr = 0, holes = 0, steps = 0;
  size_t pops = 0;
  for (auto _ : state) {
    splat::DrawList list, last_list;
    viewer::SpeedDetail speed;
    image::View last;
    for (size_t i = 0; i < m.cameras.size(); ++i) {
      const auto draw = [&](const splat::DrawList& l) {
        image::View view{kWidth, kHeight, std::vector<uint32_t>(size_t{kWidth} * kHeight),
                         std::vector<float>(size_t{kWidth} * kHeight)};
        splatter.render(l, m.cameras[i], splat::Kernel::kDisc, image::Shading({}, m.cameras[i]),
                        {kWidth, kHeight, view.colour.data(), view.depth_m.data()});
        return view;
      };
      if (state.range(2)) speed.frame(static_cast<double>(i) / kFrameRate_hz, m.cameras[i], 0.5);
      options.detail = static_cast<float>(speed.detail());
      splat::select_view(m.packer->model(), m.cameras[i], options, list);
      image::View view = draw(list);
      if (i > 0) {
        flicker.values.push_back(mean(differences(view, &m.direct[i], last, &m.direct[i - 1])));
        const Blocks blocks = differences(view, nullptr, draw(last_list), nullptr);
        switching.values.push_back(mean(blocks));
        pops += count_pops(blocks);
        steps = std::max(steps, std::abs(static_cast<double>(list.points) / static_cast<double>(last_list.points) - 1));
      }
      const image::Quality quality = image::compare(m.direct[i], view);
      psnr += quality.psnr_db / frames;
      holes += quality.hole_fraction / frames;
      points.values.push_back(static_cast<double>(list.points));
      last = std::move(view);
      std::swap(list, last_list);
    }
  }
  state.counters["switching_median"] = switching.quantile(0.5);
  state.counters["switching_peak"] = switching.quantile(1);
  state.counters["peak_over_median"] = switching.quantile(1) / switching.quantile(0.5);
  state.counters["pops_a_second"] = static_cast<double>(pops) / frames * kFrameRate_hz;
  state.counters["largest_step_of_points"] = steps;
  state.counters["flicker_median"] = flicker.quantile(0.5);
  state.counters["psnr_db"] = psnr;
  state.counters["holes"] = holes;
  state.counters["points_median"] = points.quantile(0.5);
}
BENCHMARK(lod_transitions)
    ->ArgNames({"transitions", "recorded", "speed_detail"})
    ->Args({0, 0, 0})
    ->Args({1, 0, 0})
    ->Args({0, 1, 0})
    ->Args({1, 1, 0})
    ->Args({1, 1, 1})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

// Time saved by less detail, in percent; first view, display of 2560x1600, where all samples are magnified.
void lod_detail(benchmark::State& state) {
  const Moving& m = moving(0);
  geometry::Camera camera = m.cameras[0];
  camera.width = 2560, camera.height = 1600;
  splat::SelectionOptions options;
  options.scale = 1.5f;
  options.detail = static_cast<float>(state.range(0)) / 100;
  splat::CpuSplatter splatter;
  std::vector<uint32_t> colour(size_t{2560} * 1600);
  const image::Shading shading({}, camera);
  splat::DrawList list;
  for (auto _ : state) {
    splat::select_view(m.packer->model(), camera, options, list);
    splatter.render(list, camera, splat::Kernel::kDisc, shading, {2560, 1600, colour.data(), nullptr});
  }
  state.counters["points"] = static_cast<double>(list.points);
}
BENCHMARK(lod_detail)->Arg(100)->Arg(70)->Arg(50)->Arg(30)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace telesplat
