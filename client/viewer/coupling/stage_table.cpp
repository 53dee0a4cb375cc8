#include "client/viewer/coupling/stage_table.h"

#include <iterator>

#include "common/metrics/stages.h"

namespace telesplat::viewer {
namespace {

constexpr size_t kMostWaiting = 256;
constexpr double kNotShown = -1;

std::vector<std::string> columns() {
  std::vector<std::string> out{"request", "frame", "tile", "requested_s", "complete_s"};
  for (const metrics::Stage& stage : metrics::kStages) out.emplace_back(stage.column);
  for (const char* name : {"latency_ms", "patches", "display_ms"}) out.emplace_back(name);
  return out;
}

}  // namespace

StageTable::StageTable() : table_("stages", columns()) {}

void StageTable::complete(const MeasuredUpdate& m) {
  const ViewRequester::Update& u = m.update;
  const metrics::UpdateMoments moments{.requested_s = u.requested_s,
                                       .arrived_s = m.last.arrived_s,
                                       .decode_begin_s = m.last.decode_begin_s,
                                       .decoded_s = m.last.decoded_s,
                                       .complete_s = u.complete_s};
  std::vector<double> row{double(u.request.value), double(m.last.frame.value), double(m.last.tile), u.requested_s,
                          u.complete_s};
  for (const double ms : metrics::stages_ms(m.last.moments, moments)) row.push_back(ms);
  row.push_back((u.complete_s - u.requested_s) * 1e3);
  row.push_back(double(u.tiles));
  waiting_[u.request] = {std::move(row), u.complete_s};
  if (waiting_.size() > kMostWaiting) finish(std::next(waiting_.begin()), kNotShown);
}

void StageTable::displayed(RequestId request, double end_s) { finish(waiting_.upper_bound(request), end_s); }

// The rows before `end`.
void StageTable::finish(std::map<RequestId, Waiting>::iterator end, double shown_s) {
  for (auto w = waiting_.begin(); w != end; w = waiting_.erase(w)) {
    w->second.row.push_back(shown_s == kNotShown ? kNotShown : (shown_s - w->second.complete_s) * 1e3);
    table_.add(w->second.row);
  }
}

std::optional<wire::MetricRows> StageTable::flush(InstanceId instance, bool all) {
  if (all) finish(waiting_.end(), kNotShown);
  return table_.flush(instance);
}

}  // namespace telesplat::viewer
