// The rows that a viewer sends to the master's record: frames, updates, stages, spans.
#pragma once

#include <algorithm>
#include <optional>

#include "client/viewer/coupling/stage_table.h"
#include "common/metrics/process.h"
#include "common/metrics/recorder.h"
#include "common/net/master_link.h"

namespace telesplat::viewer {

/// Used by one thread; frames and spans are added by the display's, too.
class ViewerTables {
 public:
  /// Both must outlive it.
  ViewerTables(metrics::TableRecorder& frames, metrics::SpanRecorder& spans)
      : frames_(frames), spans_(spans), updates_("updates", update_columns()) {}

  metrics::SpanRecorder& spans() { return spans_; }
  /// Returns where the update's time went; nothing: a replay of events completed it.
  std::optional<metrics::StagesMs> complete(const ViewRequester::Update& update, const ViewPart& last) {
    updates_.add(update_row({update, last}));
    spans_.add("view update", update.requested_s, update.complete_s, metrics::kOverlapping,
               {.frame = double(last.frame.value), .request = double(update.request.value)});
    return stages_.complete({update, last});
  }
  void displayed(RequestId shown, double end_s) { stages_.displayed(shown, end_s); }
  /// True once a period; `last`: always.
  bool due(double now_s, bool last) {
    if (!last && now_s - sent_s_ < kPeriod_s) return false;
    sent_s_ = now_s;
    return true;
  }
  void send(net::MasterLink& link, bool last) {
    const InstanceId own = link.instance();
    for (const auto& rows : {frames_.flush(own), updates_.flush(own), stages_.flush(own, last), spans_.flush(own)})
      if (rows) link.socket().send(*rows);
  }
  void add_status(net::MasterLink::Values& values) const {
    values[metrics::kUpdateRows] = double(updates_.gone());
    values[metrics::kStageRows] = double(stages_.gone());
  }

 private:
  static constexpr double kPeriod_s = 1.0;
  metrics::TableRecorder& frames_;
  metrics::SpanRecorder& spans_;
  metrics::TableRecorder updates_;
  StageTable stages_;
  double sent_s_ = 0;
};

}  // namespace telesplat::viewer
