#include "services/master/live/exposition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/core/utf8.h"

namespace telesplat::master {

namespace {

/// A family of series: one for each process that reports the value.
struct Family {
  const char* name;  ///< comes after "telesplat_"; names of counters end in _total
  const char* role;  ///< role of the processes; empty: all, with a label for the role
  const char* key;   ///< key in LiveProcess::values
  double unit;       ///< factor that turns a value into seconds or bytes
  const char* help;
};

constexpr Family kCounters[] = {
    {"process_messages_rejected_total", "", "messages_rejected", 1,
     "Messages dropped as malformed, oversized or unexpected."},
    {"viewer_frames_total", "viewer", "frames", 1, "Displayed frames."},
    {"viewer_updates_total", "viewer", "updates", 1, "Complete view updates."},
    {"viewer_received_bytes_total", "viewer", "bytes_received", 1, "Encoded points or slice images received."},
    {"viewer_received_points_total", "viewer", "points_received", 1, "Points inserted."},
    {"viewer_gaps_total", "viewer", "gaps_resynced", 1, "Times that events were missed and replayed."},
    {"viewer_epochs_shown_total", "viewer", "epochs_shown", 1, "Times that a changed scene was shown."},
    {"packer_tiles_total", "packer", "tiles", 1, "Tiles taken."},
    {"packer_blocks_total", "packer", "blocks", 1, "Blocks packed."},
    {"packer_frames_total", "packer", "frames_complete", 1, "Sampling frames that became complete."},
    {"packer_volume_frames_total", "packer", "volume_frames_complete", 1, "Frames of a volume that became complete."},
    {"packer_sent_bytes_total", "packer", "bytes_sent", 1, "Bytes published to viewers."},
    {"packer_points_forgotten_total", "packer", "points_forgotten", 1, "Points dropped from the model."},
    {"data_requests_total", "data", "requests", 1, "Requests for data answered."},
    {"data_sent_bytes_total", "data", "bytes_sent", 1, "Bytes sent to samplers."},
};

constexpr Family kGauges[] = {
    {"process_resident_memory_bytes", "", "rss_mb", 1e6, "Resident memory."},
    {"process_resident_memory_max_bytes", "", "peak_rss_mb", 1e6, "Most resident memory so far."},
    {"process_clock_offset_seconds", "", "clock_offset_ms", 1e-3, "The master's clock less that of the process."},
    {"process_clock_error_seconds", "", "clock_error_ms", 1e-3, "How far off the clock offset may be."},
    {"link_round_trip_seconds", "", "rtt_ms", 1e-3, "Round trip between master and process."},
    {"link_bits_per_second", "", "link_mbit", 1e6, "Measured rate of the link."},
    {"link_backlog_bytes", "", "backlog_bytes", 1, "Bytes that wait to be sent."},
    {"viewer_points", "viewer", "points", 1, "Points of the replica."},
    {"viewer_model_bytes", "viewer", "model_bytes", 1, "Memory of the replica."},
    {"viewer_pixels", "viewer", "pixels", 1, "Pixels of volume frames held."},
    {"viewer_update_age_seconds", "viewer", "update_age_ms", 1e-3,
     "Age of the newest complete update on display, median of the last seconds."},
    {"viewer_waiting_seconds", "viewer", "waits_s", 1,
     "How long the display has waited for a view update; 0: not for long."},
    {"viewer_coupling", "viewer", "coupling", 1, "Coupling in force: 0 async, 1 sync, 2 loose, 3 images."},
    {"viewer_buffers", "viewer", "buffers", 1, "Buffers of the coupling in force."},
    {"viewer_epoch", "viewer", "epoch", 1, "Version of the scene on display."},
    {"sampler_queue", "sampler", "leases_held", 1, "Leases that a sampler holds and has not sampled."},
    {"packer_points", "packer", "points", 1, "Points of the model."},
    {"packer_model_bytes", "packer", "model_bytes", 1, "Memory of the model."},
};

/// Families whose keys are in LiveProcess::rates.
constexpr Family kRates[] = {
    {"viewer_frames_per_second", "viewer", "frames", 1, "Displayed frames a second, of the last seconds."},
    {"viewer_updates_per_second", "viewer", "updates", 1, "Complete view updates a second, of the last seconds."},
    {"viewer_received_bytes_per_second", "viewer", "bytes_received", 1,
     "Bytes received a second, of the last seconds."},
};

// Prints a number. Infinities and NaN have names of their own.
std::string number(double v) {
  if (std::isnan(v)) return "NaN";
  if (std::isinf(v)) return v > 0 ? "+Inf" : "-Inf";
  return fmt::format("{}", v);
}

class Text {
 public:
  void begin(const char* name, const char* type, const char* help) {
    out_ += fmt::format("# HELP telesplat_{0} {1}\n# TYPE telesplat_{0} {2}\n", name, help, type);
  }
  void add(const std::string& name, const std::string& labels, double value) {
    out_ += fmt::format("telesplat_{}{} {}\n", name, labels, number(value));
  }
  void one(const char* name, const char* type, const char* help, double value) {
    begin(name, type, help);
    add(name, "", value);
  }
  std::string take() { return std::move(out_); }

 private:
  std::string out_;
};

std::string label_of(const std::string& name) { return fmt::format("{{name=\"{}\"}}", escaped_label(name)); }
std::string labels_of(const LiveProcess& p) {
  return fmt::format("{{role=\"{}\",name=\"{}\"}}", escaped_label(p.role), escaped_label(p.name));
}

// Returns one process for each role and name, at most kMostTold of a role, those that are here first.
std::vector<const LiveProcess*> told(const LiveSnapshot& s) {
  std::vector<const LiveProcess*> out;
  std::set<std::pair<std::string, std::string>> seen;
  std::map<std::string, size_t> count;
  for (const bool alive : {true, false})
    for (const LiveProcess& p : s.processes)
      if (p.alive == alive && count[p.role] < kMostTold && seen.emplace(to_utf8(p.role), to_utf8(p.name)).second) {
        ++count[p.role];
        out.push_back(&p);
      }
  return out;
}

void add_family(Text& text, const Family& family, const char* type, const std::vector<const LiveProcess*>& processes,
                const std::map<std::string, double> LiveProcess::*group) {
  bool begun = false;
  for (const LiveProcess* p : processes) {
    if (!p->alive || (*family.role && p->role != family.role)) continue;
    const auto value = (p->*group).find(family.key);
    if (value == (p->*group).end()) continue;
    if (!std::exchange(begun, true)) text.begin(family.name, type, family.help);
    text.add(family.name, *family.role ? label_of(p->name) : labels_of(*p), value->second * family.unit);
  }
}

void add_session(Text& text, const LiveSnapshot& s) {
  text.begin("session_info", "gauge", "What the session shows, and the version of the master.");
  text.add("session_info",
           fmt::format("{{version=\"{}\",scene=\"{}\",kind=\"{}\"}}", escaped_label(s.version), escaped_label(s.scene),
                       escaped_label(s.kind)),
           1);
  text.one("session_start_time_seconds", "gauge", "When the session began, since 1970.", s.started_at_s);
  text.one("session_epoch", "gauge", "Version of the scene.", s.epoch);
  text.one("views_completed_total", "counter", "Views of full resolution that became complete.", s.views_completed);
  text.one("views_in_flight", "gauge", "Sampling frames that were begun and are not complete.", s.views_in_flight);
  text.one("views_waiting", "gauge", "View requests that wait to be begun.", s.views_waiting);
  text.one("leases_expired_total", "counter", "Leases that ran out, and those of samplers that died.",
           s.leases_expired);
  text.one("leases_backup_total", "counter", "Tiles leased to a second sampler.", s.leases_backup);
  text.one("views_overtaken_total", "counter", "Views that ended early, because a newer one waited.",
           s.views_overtaken);
  text.one("frames_given_up_total", "counter", "Frames that ended without tiles that cannot be had.",
           s.frames_given_up);
  text.one("tiles_released_total", "counter", "Leases that were taken back.", s.tiles_released);
}

void add_samplers(Text& text, const std::vector<const LiveProcess*>& processes, const LiveFigures& figures) {
  text.begin("sampler_leases", "gauge", "Leases that are out with a sampler.");
  for (const LiveProcess* p : processes)
    if (p->alive && p->leases) text.add("sampler_leases", label_of(p->name), *p->leases);
  const auto each = [&](const char* name, const char* help, auto value) {
    text.begin(name, "counter", help);
    for (const auto& [sampler, s] : figures.samplers()) text.add(name, label_of(sampler), double(value(s)));
  };
  each("sampler_tiles_total", "Tiles sampled that reached the packer.", [](const auto& s) { return s.tiles; });
  each("sampler_rays_total", "Rays cast for them.", [](const auto& s) { return s.rays; });
  each("sampler_sampled_bytes_total", "Their encoded size.", [](const auto& s) { return s.bytes; });
  each("sampler_busy_seconds_total", "Time spent on them, sampling and encoding.",
       [](const auto& s) { return s.busy_s; });
}

void add_histogram(Text& text, const char* name, const char* help, const LiveFigures& figures,
                   const Histogram LiveFigures::Viewer::*which) {
  text.begin(name, "histogram", help);
  const std::string bucket = std::string(name) + "_bucket";
  for (const auto& [viewer, v] : figures.viewers()) {
    const Histogram& h = v.*which;
    const std::string who = escaped_label(viewer);
    for (size_t i = 0; i < Histogram::kBounds.size(); ++i)
      text.add(bucket, fmt::format("{{name=\"{}\",le=\"{}\"}}", who, Histogram::kBounds[i]), double(h.up_to(i)));
    text.add(bucket, fmt::format("{{name=\"{}\",le=\"+Inf\"}}", who), double(h.count()));
    text.add(std::string(name) + "_sum", label_of(viewer), h.sum_s());
    text.add(std::string(name) + "_count", label_of(viewer), double(h.count()));
  }
}

}  // namespace

std::string escaped_label(const std::string& text) {
  std::string out;
  for (const char c : to_utf8(text)) {
    if (c == '\\' || c == '"') out += '\\';
    if (c == '\n')
      out += "\\n";
    else
      out += c;
  }
  return out;
}

std::string exposition(const LiveSnapshot& snapshot, const LiveFigures& figures) {
  Text text;
  const auto processes = told(snapshot);
  add_session(text, snapshot);
  text.begin("process_up", "gauge", "1: the process takes part; 0: it left or died.");
  for (const LiveProcess* p : processes) text.add("process_up", labels_of(*p), p->alive ? 1 : 0);
  for (const Family& f : kCounters) add_family(text, f, "counter", processes, &LiveProcess::values);
  for (const Family& f : kGauges) add_family(text, f, "gauge", processes, &LiveProcess::values);
  for (const Family& f : kRates) add_family(text, f, "gauge", processes, &LiveProcess::rates);
  add_samplers(text, processes, figures);
  add_histogram(text, "viewer_inter_frame_delay_seconds", "From the end of a displayed frame to that of the next.",
                figures, &LiveFigures::Viewer::inter_frame);
  add_histogram(text, "viewer_motion_to_photon_seconds", "From a pose that was taken to the frame that shows it.",
                figures, &LiveFigures::Viewer::motion_to_photon);
  text.begin("viewer_refreshes_missed_total", "counter", "Refreshes of the display without a new picture.");
  for (const auto& [viewer, v] : figures.viewers())
    text.add("viewer_refreshes_missed_total", label_of(viewer), double(v.refreshes_missed));
  add_histogram(text, "viewer_update_latency_seconds", "From a view request to its complete update.", figures,
                &LiveFigures::Viewer::update_latency);
  add_histogram(text, "viewer_start_up_latency_seconds", "From a view request to the first part of its update.",
                figures, &LiveFigures::Viewer::start_up);
  return text.take();
}

namespace {

// Among entries that left, drops the one measured longest ago. False: all are here.
template <class V>
bool make_room(std::map<std::string, V>& map) {
  auto oldest = map.end();
  for (auto at = map.begin(); at != map.end(); ++at)
    if (!at->second.here && (oldest == map.end() || at->second.measured_at < oldest->second.measured_at)) oldest = at;
  if (oldest == map.end()) return false;
  map.erase(oldest);
  return true;
}

// Calls add() with the values of column `name`, except in rows whose column `unless`, if there is one, is not 0.
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

// Returns the entry of this name, a new one if need be. Null: there is no room for another name.
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
    if (ms != 0) v->inter_frame.add(ms / 1e3);  // a first frame has no delay and reports 0
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
