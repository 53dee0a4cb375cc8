#include "tools/telesplat/tune/model.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "common/core/check.h"

namespace telesplat::launcher {
namespace {

constexpr double kLeastCores = 0.25;
constexpr int kRounds = 200;  // of the fixed point; a longer interval only grows until all rays are cast
constexpr double kNear = 1e-9;

// Clusters are cells of a surface: four times as many with each level.
double clusters(int depth, int measured) { return std::pow(4.0, depth - measured); }
// A plan looks at clusters and at pixels: measured from 5 to 6 levels it took 1.25 to 1.55 times as long.
double planning(int depth, int measured) { return std::pow(1.4, depth - measured); }
// Clusters at the picture's rim are drawn whole: a share of all that halves with each level.
double rim(int depth) { return 1 + 4 * std::pow(0.5, depth); }
// Points of all levels, a quarter with each coarser one.
double levels(int depth) { return (1 - std::pow(0.25, depth + 1)) / 0.75; }

double select_time(const TuneCosts& c, const TuneSettings& s) {
  return c.slices ? c.select_s : c.select_s * clusters(s.octree_depth, c.measured_depth);
}

// Points that are drawn beyond those that were when costs were measured; negative: fewer.
double more_points(const TuneCosts& c, const TuneSettings& s) {
  if (c.slices) return 0;
  return c.points_drawn * (rim(s.octree_depth) / rim(c.measured_depth) - 1);
}

double work(const TuneCosts& c, const TuneSettings& s) {
  const double drawing_s = std::max(0.0, c.draw_s + c.point_s * more_points(c, s));
  return select_time(c, s) + drawing_s;
}

struct Tiling {
  double pixels, tiles;
};
Tiling tiling(const TuneCosts& c, const TuneSettings& s) {
  const double width = std::ceil(c.display_width * s.scale), height = std::ceil(c.display_height * s.scale);
  const double tiles = std::ceil(width / s.tile_px) * std::ceil(height / s.tile_px);
  return {width * height, c.slices ? double(s.samplers) : std::max(1.0, tiles * c.tile_share)};
}

// Costs of one update, given the time since the one before.
Prediction update_after(const TuneCosts& c, const TuneSettings& s, double interval_s) {
  Prediction out;
  const auto [pixels, tiles] = tiling(c, s);
  const double share = c.steered ? std::min(1.0, c.checked + c.novelty_hz * interval_s) : 1;
  out.rays = c.slices ? c.voxels : share * pixels;
  const double samples = c.slices ? c.slice_pixels : out.rays * c.covered;
  const double kept = samples * c.kept;
  out.plan_s = c.steered && !c.slices ? c.plan.at(pixels) * planning(s.octree_depth, c.measured_depth) : 0;
  out.connections_s = c.connect_s * connections(c, s.samplers);
  const double one_s = c.tile_s + out.rays / tiles * (c.sample_s / threads_of(c, s.samplers) + c.encode_s);
  out.sampling_s = std::ceil(tiles / s.samplers) * one_s * crowding(c, s);
  const double deeper = c.slices ? 1 : levels(s.octree_depth) / levels(c.measured_depth);
  out.packing_s = tiles * c.pack.fixed + samples * c.pack.slope * deeper;
  out.tiles_way_s = out.rays * c.tile_bytes * c.sampler.byte_s / s.samplers;
  out.patches_way_s = (tiles * c.patch_bytes.fixed + kept * c.patch_bytes.slope) * c.viewer.byte_s;
  out.decoding_s = kept * c.decode_s;

  const auto steps = {out.sampling_s, out.packing_s, out.tiles_way_s, out.patches_way_s, out.decoding_s};
  double sum_s = 0;
  for (const double step : steps) sum_s += step;
  const double longest_s = std::max(steps);
  // Tiles follow each other through the steps; a volume's frame goes on when all slabs are there.
  const double chain_s = c.slices ? sum_s : longest_s + (sum_s - longest_s) / tiles;

  const double cpu_s =
      out.plan_s + out.connections_s + tiles * c.tile_s + out.rays * (c.sample_s + c.encode_s) + out.packing_s;
  const double in_order_s = (out.plan_s + out.sampling_s + out.packing_s) / std::max(1, c.frames_in_flight);
  // The samplers serve all viewers; each has a way of its own.
  out.bottleneck_s = std::max({c.viewers * std::max({longest_s, out.plan_s, in_order_s}), out.connections_s,
                               c.viewers * cpu_s / free_cores(c, s)});
  const double use = out.bottleneck_s * s.update_rate_hz;
  out.queue_s = !c.polled  ? 0
                : use >= 1 ? out.bottleneck_s
                           : std::min(out.bottleneck_s, out.bottleneck_s * use / (2 * (1 - use)));
  out.latency_s = c.viewer.rtt_s + c.sampler.rtt_s + out.plan_s + out.connections_s + chain_s + out.queue_s;
  return out;
}

double interval_of(const TuneCosts& c, const TuneSettings& s, const Prediction& p) {
  const double asked_s = c.polled ? 1 / s.update_rate_hz : p.latency_s + p.frame_s;
  return std::max(asked_s, p.bottleneck_s);
}

}  // namespace

Way way_of(const links::Link& link) {
  Way out{.rtt_s = link.rtt_s + link.jitter_s, .byte_s = link.rate_bit_s > 0 ? 8 / link.rate_bit_s : 0};
  if (link.stall_every_s <= 0) return out;
  const double stalled = link.stall_s / link.stall_every_s;
  out.byte_s /= 1 - stalled;
  out.rtt_s += stalled * link.stall_s / 2;  // whatever comes in a stall waits half of it
  return out;
}

double frame_time(const TuneCosts& c, const TuneSettings& s) {
  const double work_s = std::max(0.0, c.frame_s + select_time(c, s) - c.select_s + c.point_s * more_points(c, s));
  return c.target_fps > 0 ? std::max(work_s, 1 / c.target_fps) : work_s;
}

double free_cores(const TuneCosts& c, const TuneSettings& s) {
  const double frame_s = frame_time(c, s);
  const double display = frame_s > 0 ? c.viewers * work(c, s) / frame_s : 0;
  return std::max(kLeastCores, c.cores * (1 - c.others) - display);
}

int threads_of(const TuneCosts& c, int samplers) {
  return c.sampler_threads > 0 ? c.sampler_threads : std::max(1, int(c.cores) / samplers);
}

double crowding(const TuneCosts& c, const TuneSettings& s) {
  return std::max(1.0, s.samplers * threads_of(c, s.samplers) / free_cores(c, s));
}

double connections(const TuneCosts& c, int samplers) {
  // Each sampler: master, packer, data servers; each viewer: master and packer.
  return samplers * (2.0 + c.data_servers) + 2.0 * c.viewers;
}

Prediction predict(const TuneCosts& c, const TuneSettings& s) {
  CHECK(s.samplers >= 1 && s.tile_px >= 1 && s.octree_depth >= 1 && s.scale > 0 && s.scale <= 1 &&
        s.update_rate_hz > 0);
  Prediction out;
  double interval_s = c.polled ? 1 / s.update_rate_hz : 0;
  for (int i = 0; i < kRounds; ++i) {
    out = update_after(c, s, interval_s);
    out.frame_s = frame_time(c, s);
    const double next_s = interval_of(c, s, out);
    const bool settled = next_s - interval_s <= kNear * next_s;
    interval_s = std::max(interval_s, next_s);
    if (settled) break;
  }
  out.updates_per_s = 1 / interval_s;
  out.age_s = out.latency_s + interval_s;
  const double coarse = 1 / (s.scale * s.scale);
  out.quality_db = 0 - 10 * std::log10(coarse + c.novelty_hz * (out.latency_s + interval_s / 2));
  return out;
}

}  // namespace telesplat::launcher
