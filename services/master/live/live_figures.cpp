#include "services/master/live/live_figures.h"

#include <algorithm>
#include <cmath>

namespace telesplat::master {
namespace {

template <class V>
V* entry(std::map<std::string, V>& map, const std::string& name) {
  if (const auto found = map.find(name); found != map.end()) return &found->second;
  return map.size() < LiveFigures::kMostNames ? &map[name] : nullptr;
}

// The column's values, in milliseconds; a first frame has no delay and tells 0.
void add_column(const wire::MetricRows& rows, const char* name, bool zero_is_none, Histogram& out) {
  const auto column = std::find(rows.columns.begin(), rows.columns.end(), name);
  for (auto i = size_t(column - rows.columns.begin()); i < rows.values.size() && column != rows.columns.end();
       i += rows.columns.size())
    if (!zero_is_none || rows.values[i] != 0) out.add(rows.values[i] / 1e3);
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

void LiveFigures::add_rows(const std::string& viewer, const wire::MetricRows& rows) {
  if (rows.table != "frames" && rows.table != "updates") return;
  Viewer* v = entry(viewers_, viewer);
  if (!v) return;
  if (rows.table == "frames") return add_column(rows, "inter_frame_ms", true, v->inter_frame);
  add_column(rows, "latency_ms", false, v->update_latency);
  add_column(rows, "start_up_ms", false, v->start_up);
}

void LiveFigures::add_tile(const std::string& sampler, const wire::TileDone& tile) {
  Sampler* s = entry(samplers_, sampler);
  if (!s) return;
  ++s->tiles;
  s->bytes += tile.bytes_sampled;
  s->rays += tile.rays;
  const double busy_s = tile.moments.encode_end_s - tile.moments.sample_begin_s;
  if (std::isfinite(busy_s)) s->busy_s += std::max(0.0, busy_s);
}

}  // namespace telesplat::master
