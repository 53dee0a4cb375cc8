#include "client/viewer/coupling/stage_table.h"

#include <iterator>

#include "common/metrics/columns.h"

namespace telesplat::viewer {
namespace {

using Stages = const UpdateStages&;

constexpr size_t kMostWaiting = 256;
constexpr double kNotShown = -1;

constexpr metrics::Column<UpdateStages> kBefore[] = {
    {"request", [](Stages u) { return double(u.request.value); }},
    {"frame", [](Stages u) { return double(u.frame.value); }},
    {"tile", [](Stages u) { return double(u.tile); }},
    {"requested_s", [](Stages u) { return u.requested_s; }},
    {"complete_s", [](Stages u) { return u.complete_s; }},
};
// The columns of the stages stand between the two lists.
constexpr metrics::Column<UpdateStages> kAfter[] = {
    {"latency_ms", [](Stages u) { return (u.complete_s - u.requested_s) * 1e3; }},
    {"patches", [](Stages u) { return double(u.patches); }},
    {"display_ms", [](Stages u) { return u.display_ms; }},
};

template <class T>
std::vector<T> joined(std::vector<T> out, const std::vector<T>& b, const std::vector<T>& c) {
  out.insert(out.end(), b.begin(), b.end());
  out.insert(out.end(), c.begin(), c.end());
  return out;
}

using U = const MeasuredUpdate&;

constexpr metrics::Column<MeasuredUpdate> kUpdateColumns[] = {
    {"request", [](U m) { return double(m.update.request.value); }},
    {"frame", [](U m) { return double(m.last.frame.value); }},
    {"requested_s", [](U m) { return m.update.requested_s; }},
    {"first_s", [](U m) { return m.update.first_s; }},
    {"complete_s", [](U m) { return m.update.complete_s; }},
    {"latency_ms", [](U m) { return (m.update.complete_s - m.update.requested_s) * 1e3; }},
    {"start_up_ms", [](U m) { return (m.update.first_s - m.update.requested_s) * 1e3; }},
    {"tiles", [](U m) { return double(m.update.tiles); }},
    {"samples", [](U m) { return double(m.update.samples); }},
    {"points", [](U m) { return double(m.update.points); }},
    {"bytes", [](U m) { return double(m.update.bytes); }},
    {"eliminated", [](U m) { return m.update.samples ? double(m.update.eliminated) / double(m.update.samples) : 0.0; }},
    {"sampling_width", [](U m) { return double(m.last.camera.width); }},
    {"sampling_height", [](U m) { return double(m.last.camera.height); }},
    {"epoch", [](U m) { return double(m.last.epoch.value); }},
    {"extra_points", [](U m) { return double(m.update.extra.points); }},
    {"extra_bytes", [](U m) { return double(m.update.extra.bytes); }},
    {"left_out", [](U m) { return double(m.last.left_out); }},
};

}  // namespace

StageTable::StageTable()
    : table_("stages",
             joined(metrics::names(kBefore), metrics::names(metrics::kStageColumns), metrics::names(kAfter))) {}

std::optional<metrics::StagesMs> StageTable::complete(const MeasuredUpdate& m) {
  const ViewRequester::Update& u = m.update;
  if (m.last.moments == wire::Moments{}) return std::nullopt;  // a replay sent it again: its moments are not known
  const metrics::UpdateMoments moments{.requested_s = u.requested_s,
                                       .arrived_s = m.last.arrived_s,
                                       .decode_begin_s = m.last.decode_begin_s,
                                       .decoded_s = m.last.decoded_s,
                                       .complete_s = u.complete_s};
  const auto stages = metrics::stages_ms(m.last.moments, moments);
  waiting_[u.request] = {.request = u.request,
                         .frame = m.last.frame,
                         .tile = m.last.tile,
                         .patches = u.tiles,
                         .requested_s = u.requested_s,
                         .complete_s = u.complete_s,
                         .stages = stages};
  if (waiting_.size() > kMostWaiting) finish(std::next(waiting_.begin()), kNotShown);
  return stages;
}

void StageTable::displayed(RequestId request, double end_s) { finish(waiting_.upper_bound(request), end_s); }

// Finishes the rows before `end`.
void StageTable::finish(std::map<RequestId, UpdateStages>::iterator end, double shown_s) {
  for (auto w = waiting_.begin(); w != end; w = waiting_.erase(w)) {
    UpdateStages& u = w->second;
    if (shown_s != kNotShown) u.display_ms = (shown_s - u.complete_s) * 1e3;
    table_.add(joined(metrics::values(kBefore, u), metrics::values(metrics::kStageColumns, u.stages),
                      metrics::values(kAfter, u)));
  }
}

std::optional<wire::MetricRows> StageTable::flush(InstanceId instance, bool all) {
  if (all) finish(waiting_.end(), kNotShown);
  return table_.flush(instance);
}

std::vector<std::string> update_columns() { return metrics::names(kUpdateColumns); }
std::vector<double> update_row(const MeasuredUpdate& measured) { return metrics::values(kUpdateColumns, measured); }

}  // namespace telesplat::viewer
