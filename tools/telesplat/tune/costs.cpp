#include "tools/telesplat/tune/costs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/core/check.h"
#include "common/metrics/statistics.h"

namespace telesplat::launcher {
namespace {

constexpr size_t kGroups = 12;

using Values = std::vector<double>;

double sum(const Values& values) { return std::accumulate(values.begin(), values.end(), 0.0); }
double median(const Values& values) { return metrics::distribution(values).median; }
double ratio(double a, double b, double otherwise) { return b > 0 ? a / b : otherwise; }

// A list of all runs together, each value as `change` makes it of the run and the value.
template <class List, class Change>
Values joined(const std::vector<CostSamples>& runs, const List& list, const Change& change) {
  Values out;
  for (const CostSamples& run : runs)
    for (const double value : list(run)) out.push_back(change(run, value));
  return out;
}
template <class List>
Values joined(const std::vector<CostSamples>& runs, const List& list) {
  return joined(runs, list, [](const CostSamples&, double value) { return value; });
}

void fit_display(TuneCosts& c, const CostSamples& run) {
  const auto& f = run.frames;
  c.select_s = median(f.select_s);
  c.draw_s = median(f.draw_s);
  c.frame_s = median(f.construction_s);
  c.points_drawn = median(f.points);
  c.point_s = fit_line(f.points, f.construction_s).slope;
  c.measured_depth = run.octree_depth;
}

void fit_samplers(TuneCosts& c, const std::vector<CostSamples>& runs) {
  const auto crowd = [&](const CostSamples& run) {
    TuneCosts then = c;
    then.others = run.others;
    return crowding(then, {.samplers = run.samplers, .octree_depth = run.octree_depth});
  };
  const auto alone = [&](const CostSamples& run, double value) { return value / crowd(run); };
  const Values work = joined(runs, [](const auto& r) { return r.tiles.work; });
  const Values a_thread = joined(
      runs, [](const auto& r) { return r.tiles.work; },
      [&](const CostSamples& run, double value) { return value / threads_of(c, run.samplers); });
  const Line sampling = fit_line(a_thread, joined(
                                               runs, [](const auto& r) { return r.tiles.sampling_s; }, alone));
  const Line encoding = fit_line(work, joined(
                                           runs, [](const auto& r) { return r.tiles.encoding_s; }, alone));
  c.sample_s = sampling.slope, c.encode_s = encoding.slope;
  c.tile_s = sampling.fixed + encoding.fixed;
  c.tile_bytes = ratio(sum(joined(runs, [](const auto& r) { return r.tiles.bytes_sampled; })), sum(work), 0);
}

void fit_packing(TuneCosts& c, const std::vector<CostSamples>& runs) {
  const Values work = joined(runs, [](const auto& r) { return r.tiles.work; });
  const Values samples = joined(runs, [](const auto& r) { return r.tiles.samples; });
  const Values kept = joined(runs, [](const auto& r) { return r.tiles.kept; });
  c.pack = fit_line(samples, joined(runs, [](const auto& r) { return r.tiles.packing_s; }));
  c.covered = c.slices ? 1 : std::min(1.0, ratio(sum(samples), sum(work), 1));
  c.kept = c.slices ? 1 : std::min(1.0, ratio(sum(kept), sum(samples), 1));
  const Values bytes = joined(runs, [](const auto& r) { return r.tiles.bytes_sent; });
  // A frame of a volume goes out with the slab that completed it: only the sums belong together.
  c.patch_bytes = c.slices ? Line{0, ratio(sum(bytes), sum(kept), 0)} : fit_line(kept, bytes);
  if (c.slices) {
    c.voxels = median(joined(runs, [](const auto& r) { return r.update_work; }));
    c.slice_pixels = median(joined(runs, [](const auto& r) { return r.update_pixels; }));
  }
}

void fit_views(TuneCosts& c, const std::vector<CostSamples>& runs) {
  const Values pixels = joined(runs, [](const auto& r) { return r.plans.pixels; });
  c.steered = !c.slices && !pixels.empty();
  if (!c.steered) {
    c.checked = c.novelty_hz = 0;
    return;
  }
  c.plan = fit_line(pixels, joined(runs, [](const auto& r) { return r.plans.seconds; }));
  // By the run of the defaults: what becomes new depends on the time between its updates.
  const CostSamples& first = runs.front();
  const double share = std::min(1.0, ratio(sum(first.plans.cast), sum(first.plans.pixels), 1));
  double checked = 0;
  for (const double rays : first.plans.checked) checked += std::isfinite(rays) ? rays : 0;
  c.checked = std::min(checked / sum(first.plans.pixels), share);
  double tiles = 0, of = 0;
  for (size_t i = 0; i < first.plans.tiles.size(); ++i) {
    if (!std::isfinite(first.plans.tiles[i])) continue;
    tiles += first.plans.tiles[i], of += first.plans.pixels[i] / (double(first.tile_px) * first.tile_px);
  }
  c.tile_share = std::min(1.0, ratio(tiles, of, 1));
  c.novelty_hz = (share - c.checked) * first.updates_per_s;
}

void fit_network(TuneCosts& c, bool stated, const std::vector<CostSamples>& runs) {
  c.connect_s = median(joined(runs, [](const auto& r) { return r.stages.lease_network_s; }));
  const Values points = joined(runs, [](const auto& r) { return r.stages.patch_points; });
  c.decode_s = ratio(sum(joined(runs, [](const auto& r) { return r.stages.decode_s; })), sum(points), 0);
  if (stated) return;
  const Line patch = fit_line(joined(runs, [](const auto& r) { return r.stages.patch_bytes; }),
                              joined(runs, [](const auto& r) { return r.stages.patch_network_s; }));
  c.viewer = {2 * patch.fixed, patch.slope};
}

}  // namespace

Line fit_line(const Values& xs, const Values& ys) {
  CHECK(xs.size() == ys.size());
  std::vector<std::pair<double, double>> pairs;
  for (size_t i = 0; i < xs.size(); ++i)
    if (std::isfinite(xs[i]) && std::isfinite(ys[i])) pairs.emplace_back(xs[i], ys[i]);
  if (pairs.empty()) return {};
  std::stable_sort(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  Values gx, gy;
  const size_t groups = std::min(kGroups, pairs.size());
  for (size_t g = 0; g < groups; ++g) {
    Values x, y;
    for (size_t i = g * pairs.size() / groups; i < (g + 1) * pairs.size() / groups; ++i) {
      x.push_back(pairs[i].first);
      y.push_back(pairs[i].second);
    }
    gx.push_back(median(x)), gy.push_back(median(y));
  }
  const double n = double(groups), mean_x = sum(gx) / n, mean_y = sum(gy) / n;
  double xx = 0, xy = 0, from_zero_xx = 0, from_zero_xy = 0;
  for (size_t g = 0; g < groups; ++g) {
    xx += (gx[g] - mean_x) * (gx[g] - mean_x), xy += (gx[g] - mean_x) * (gy[g] - mean_y);
    from_zero_xx += gx[g] * gx[g], from_zero_xy += gx[g] * gy[g];
  }
  const Line through_zero{0, from_zero_xx > 0 ? std::max(0.0, from_zero_xy / from_zero_xx) : 0};
  if (xx <= 1e-12 * from_zero_xx) return from_zero_xx > 0 ? through_zero : Line{std::max(0.0, mean_y), 0};
  const double slope = xy / xx, fixed = mean_y - slope * mean_x;
  // A falling line says that x is not what the time went by in these few values; work costs time nevertheless.
  return slope <= 0 || fixed < 0 ? through_zero : Line{fixed, slope};
}

double adaptive_scale(const CostSamples& run) {
  return run.scales.empty() ? 1 : std::clamp(median(run.scales), 0.1, 1.0);
}

TuneCosts fit_costs(TuneCosts c, bool stated, const std::vector<CostSamples>& runs) {
  CHECK(!runs.empty());
  c.others = median(joined(runs, [](const auto& r) { return Values{r.others}; }));
  fit_display(c, runs.front());
  fit_samplers(c, runs);
  fit_packing(c, runs);
  fit_views(c, runs);
  fit_network(c, stated, runs);
  return c;
}

std::vector<std::string> describe(const TuneCosts& c) {
  const char* work = c.slices ? "voxel" : "ray";
  const char* sample = c.slices ? "pixel of slice images" : "sample";
  std::vector<std::string> out{
      fmt::format("machine: {:.0f} cores, others use {:.0f} % of them", c.cores, 100 * c.others),
      fmt::format("{}: {:.3f} us sampling, {:.3f} us encoding; {}: {:.3f} ms", work, 1e6 * c.sample_s, 1e6 * c.encode_s,
                  c.slices ? "slab" : "tile", 1e3 * c.tile_s),
      fmt::format("connection: {:.3f} ms each update", 1e3 * c.connect_s),
      fmt::format("packing: {:.3f} ms and {:.3f} us a {}", 1e3 * c.pack.fixed, 1e6 * c.pack.slope, sample),
      fmt::format("decoding and insertion: {:.3f} us a {}", 1e6 * c.decode_s, c.slices ? "pixel" : "point")};
  if (c.slices)
    out.push_back(fmt::format("view update: {:.0f} voxels, {:.0f} pixels of slice images, {:.2f} bytes each", c.voxels,
                              c.slice_pixels, c.patch_bytes.slope));
  else
    out.push_back(
        fmt::format("patch: {:.0f} bytes and {:.2f} a kept sample; {:.0f} % of rays meet the data, {:.0f} % of "
                    "samples are kept",
                    c.patch_bytes.fixed, c.patch_bytes.slope, 100 * c.covered, 100 * c.kept));
  if (c.steered)
    out.push_back(
        fmt::format("plan: {:.3f} ms and {:.3f} us for 1000 pixels; {:.0f} % of a view becomes new in a second",
                    1e3 * c.plan.fixed, 1e9 * c.plan.slope, 100 * c.novelty_hz));
  const std::string rate =
      c.viewer.byte_s > 0 ? fmt::format("{:.1f} Mbit/s", 8e-6 / c.viewer.byte_s) : std::string("no limit of rate seen");
  out.push_back(fmt::format("link to viewers: round trip {:.3f} ms, {}", 1e3 * c.viewer.rtt_s, rate));
  out.push_back(fmt::format("display: {:.2f} ms a frame, {:.2f} ms of it choosing; {:.4f} us a drawn point",
                            1e3 * c.frame_s, 1e3 * c.select_s, 1e6 * c.point_s));
  return out;
}

}  // namespace telesplat::launcher
