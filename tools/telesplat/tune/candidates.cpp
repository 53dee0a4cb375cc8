#include "tools/telesplat/tune/candidates.h"

#include <algorithm>
#include <cmath>

namespace telesplat::launcher {
namespace {

constexpr double kHalfLatency_db = 3;      // so much quality counts as much as half the latency
constexpr double kPriceOfAChange = 0.005;  // in score: what a change must bring at least
constexpr double kNoWorse = 1.01;
constexpr double kNoWorse_db = 0.1;
constexpr int kLeastCandidates = 2;  // where fewer are better than the defaults, near ones fill up

template <class T>
std::vector<T> with(std::vector<T> values, T more) {
  values.push_back(more);
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

struct Bounds {
  double times, db;
};
constexpr Bounds kNone{kNoWorse, kNoWorse_db};
constexpr Bounds kNear{1.2, 1};  // a model errs as much

bool no_worse(const Prediction& p, const Prediction& base, const Bounds& by) {
  return p.latency_s <= base.latency_s * by.times && p.age_s <= base.age_s * by.times &&
         p.frame_s <= base.frame_s * by.times && p.quality_db >= base.quality_db - by.db;
}

// Runs could not tell them apart.
bool alike(const Prediction& a, const Prediction& b) {
  return std::abs(a.latency_s - b.latency_s) <= (kNoWorse - 1) * a.latency_s &&
         std::abs(a.quality_db - b.quality_db) <= kNoWorse_db;
}

}  // namespace

TuneGrid grid_around(const TuneSettings& d, int cores, int largest_samplers) {
  TuneGrid out;
  std::vector<int> samplers{1};
  for (int n = 2; n <= 2 * std::max(1, cores) && n <= largest_samplers; n = n < 4 ? n + 1 : n * 3 / 2)
    samplers.push_back(n);
  if (cores <= largest_samplers) samplers = with(samplers, std::max(1, cores));
  out.samplers = with(samplers, d.samplers);
  out.tile_px = with({64, 128, 256, 512}, d.tile_px);
  out.scale = {0.4, 0.5, 0.6, 0.7, 0.85, 1.0};
  out.octree_depth = with({4, 5, 6}, d.octree_depth);
  out.update_rate_hz = with({5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 60.0}, d.update_rate_hz);
  return out;
}

std::vector<TuneSettings> settings_of(const TuneGrid& grid, const TuneSettings& defaults) {
  std::vector<TuneSettings> out{defaults};
  for (const int samplers : grid.samplers)
    for (const int tile_px : grid.tile_px)
      for (const int depth : grid.octree_depth)
        for (const double rate : grid.update_rate_hz) {
          const auto add = [&](double scale, bool adaptive) {
            const TuneSettings s{samplers, tile_px, scale, adaptive, depth, rate};
            if (s != defaults) out.push_back(s);
          };
          if (grid.adaptive) add(defaults.scale, defaults.adaptive);
          for (const double scale : grid.scale) add(scale, false);
        }
  return out;
}

int differences(const TuneSettings& a, const TuneSettings& b) {
  return (a.samplers != b.samplers) + (a.tile_px != b.tile_px) + (a.scale != b.scale || a.adaptive != b.adaptive) +
         (a.octree_depth != b.octree_depth) + (a.update_rate_hz != b.update_rate_hz);
}

double score(double latency_s, double quality_db, double base_latency_s, double base_quality_db) {
  const double faster = latency_s > 0 && base_latency_s > 0 ? std::log(base_latency_s / latency_s) : 0;
  return faster + (quality_db - base_quality_db) * std::log(2.0) / kHalfLatency_db;
}

std::vector<Candidate> propose(const TuneCosts& costs, const TuneSettings& defaults, const TuneGrid& grid, int count) {
  const Prediction base = predict(costs, defaults);
  const auto net = [&](const Candidate& c) { return c.score - kPriceOfAChange * differences(c.settings, defaults); };
  std::vector<Candidate> better, near;
  for (const TuneSettings& s : settings_of(grid, defaults)) {
    if (s == defaults) continue;
    const Prediction p = predict(costs, s);
    const Candidate c{s, p, score(p.latency_s, p.quality_db, base.latency_s, base.quality_db)};
    if (no_worse(p, base, kNone) && net(c) > 0)
      better.push_back(c);
    else if (no_worse(p, base, kNear) && !alike(p, base))
      near.push_back(c);
  }
  const auto first = [&](const Candidate& a, const Candidate& b) { return net(a) > net(b); };
  std::stable_sort(better.begin(), better.end(), first);
  std::stable_sort(near.begin(), near.end(), first);
  std::vector<Candidate> out;
  const auto take = [&](const Candidate& c, int most) {
    const bool there =
        std::any_of(out.begin(), out.end(), [&](const auto& o) { return alike(o.predicted, c.predicted); });
    if (!there && int(out.size()) < most) out.push_back(c);
  };
  if (!better.empty()) {
    take(better.front(), count);
    take(*std::min_element(better.begin(), better.end(),
                           [](const auto& a, const auto& b) { return a.predicted.latency_s < b.predicted.latency_s; }),
         count);
    take(
        *std::max_element(better.begin(), better.end(),
                          [](const auto& a, const auto& b) { return a.predicted.quality_db < b.predicted.quality_db; }),
        count);
  }
  for (const Candidate& c : better) take(c, count);
  for (const Candidate& c : near) take(c, std::min(count, kLeastCandidates));
  return out;
}

}  // namespace telesplat::launcher
