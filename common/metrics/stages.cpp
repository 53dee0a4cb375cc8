#include "common/metrics/stages.h"

#include <algorithm>

namespace telesplat::metrics {

StagesMs stages_ms(const wire::Moments& part, const UpdateMoments& update) {
  // End of each stage. Fetching ends where sampling begins.
  const double fetched_s = part.sample_begin_s;
  const double fetch_begin_s = part.fetch_s > 0 ? std::max(fetched_s - part.fetch_s, part.lease_arrived_s) : fetched_s;
  const double ends_s[kStageCount] = {
      part.received_s,  part.begun_s,      part.planned_s,        part.leased_s,    part.lease_arrived_s, fetch_begin_s,
      fetched_s,        part.sample_end_s, part.encode_end_s,     part.arrived_s,   part.receive_s,       part.packed_s,
      part.published_s, update.arrived_s,  update.decode_begin_s, update.decoded_s, update.complete_s};
  StagesMs out{};
  double before_s = update.requested_s;
  for (size_t i = 0; i < kStageCount; ++i) {
    if (ends_s[i] == 0) continue;
    out[i] = (ends_s[i] - before_s) * 1e3;
    before_s = ends_s[i];
  }
  return out;
}

double sum_ms(const StagesMs& stages, std::string_view ending) {
  double out = 0;
  for (const auto& column : kStageColumns)
    if (std::string_view(column.name).ends_with(ending)) out += column.get(stages);
  return out;
}

}  // namespace telesplat::metrics
