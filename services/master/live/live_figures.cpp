#include "services/master/live/live_figures.h"

#include <algorithm>
#include <cmath>

namespace telesplat::master {
namespace {

// Drops the one of those that left that was measured longest ago. False: all are here.
template <class V>
bool make_room(std::map<std::string, V>& map) {
  auto oldest = map.end();
  for (auto at = map.begin(); at != map.end(); ++at)
    if (!at->second.here && (oldest == map.end() || at->second.measured_at < oldest->second.measured_at)) oldest = at;
  if (oldest == map.end()) return false;
  map.erase(oldest);
  return true;
}

// The column's values that count by that of another column of their row (none: all do).
template <class Add>
void each(const wire::MetricRows& rows, const char* name, const char* unless, Add&& add) {
  const auto place = [&](const char* column) {
    return size_t(std::find(rows.columns.begin(), rows.columns.end(), column) - rows.columns.begin());
  };
  const size_t width = rows.columns.size(), at = place(name), other = place(unless);
  for (size_t row = 0; at < width && row + width <= rows.values.size(); row += width)
    if (other == width || rows.values[row + other] == 0) add(rows.values[row + at]);
}

}  // namespace

void Histogram::add(double seconds) {
  if (!std::isfinite(seconds)) return;
  seconds = std::max(seconds, 0.0);
  ++count_;
  sum_s_ += seconds;
  const auto bucket = std::lower_bound(kBounds.begin(), kBounds.end(), seconds);
  if (bucket != kBounds.end()) ++counts_[size_t(bucket - kBounds.begin())];
}

uint64_t Histogram::up_to(size_t bucket) const {
  uint64_t out = 0;
  for (size_t i = 0; i <= bucket && i < counts_.size(); ++i) out += counts_[i];
  return out;
}

// Null: there is no room for another name.
template <class V>
V* LiveFigures::entry(std::map<std::string, V>& map, const std::string& name, bool here) {
  auto found = map.find(name);
  if (found == map.end()) {
    if (map.size() >= kMostNames && !make_room(map)) return nullptr;
    found = map.try_emplace(name).first;
  }
  found->second.here = here;
  found->second.measured_at = ++measured_;
  return &found->second;
}

void LiveFigures::set_here(const std::string& role, const std::string& name, bool here) {
  if (const auto v = viewers_.find(name); role == "viewer" && v != viewers_.end()) v->second.here = here;
  if (const auto s = samplers_.find(name); role == "sampler" && s != samplers_.end()) s->second.here = here;
}

void LiveFigures::add_rows(const std::string& viewer, const wire::MetricRows& rows) {
  if (rows.table != "frames" && rows.table != "updates") return;
  Viewer* v = entry(viewers_, viewer, true);
  if (!v) return;
  const auto add_to = [](Histogram& out) { return [&out](double ms) { out.add(ms / 1e3); }; };
  if (rows.table == "updates") {
    each(rows, "latency_ms", "", add_to(v->update_latency));
    return each(rows, "start_up_ms", "", add_to(v->start_up));
  }
  each(rows, "inter_frame_ms", "still", [&](double ms) {
    if (ms != 0) v->inter_frame.add(ms / 1e3);  // a first frame has no delay and tells 0
  });
  each(rows, "motion_to_photon_ms", "still", add_to(v->motion_to_photon));
  each(rows, "missed", "",
       [&](double missed) { v->refreshes_missed += missed > 0 && missed < 1e9 ? uint64_t(missed) : 0; });
}

void LiveFigures::add_tile(const std::string& sampler, const wire::TileDone& tile, bool here) {
  Sampler* s = entry(samplers_, sampler, here);
  if (!s) return;
  ++s->tiles;
  s->bytes += tile.bytes_sampled;
  s->rays += tile.rays;
  const double busy_s = tile.moments.encode_end_s - tile.moments.sample_begin_s;
  if (std::isfinite(busy_s)) s->busy_s += std::max(0.0, busy_s);
}

}  // namespace telesplat::master
