// stages.csv (docs/metrics.md): one row for each complete view update, with the time of each stage. A row waits until a
// frame has shown its update.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/viewer/coupling/view_requester.h"
#include "common/metrics/recorder.h"
#include "common/metrics/stages.h"

namespace telesplat::viewer {

/// A row of the table.
struct UpdateStages {
  RequestId request;
  FrameId frame;
  uint64_t tile = 0, patches = 0;
  double requested_s = 0, complete_s = 0;
  metrics::StagesMs stages{};
  double display_ms = -1;  ///< -1: no frame showed it
};

/// last: the part that completed the update.
struct MeasuredUpdate {
  const ViewRequester::Update& update;
  const ViewPart& last;
};

std::vector<std::string> update_columns();
std::vector<double> update_row(const MeasuredUpdate& measured);

/// Used by one thread.
class StageTable {
 public:
  StageTable();
  /// The update is complete; returns the time of each stage. Nothing: a replay of events completed it, so it has no
  /// row.
  std::optional<metrics::StagesMs> complete(const MeasuredUpdate& measured);
  /// A frame that ended at end_s (master's clock) shows this update, and all before it.
  void displayed(RequestId request, double end_s);
  /// Returns the finished rows; `all`: also those whose updates no frame has shown.
  std::optional<wire::MetricRows> flush(InstanceId instance, bool all);
  uint64_t gone() const { return table_.gone(); }

 private:
  void finish(std::map<RequestId, UpdateStages>::iterator end, double shown_s);

  metrics::TableRecorder table_;
  std::map<RequestId, UpdateStages> waiting_;
};

}  // namespace telesplat::viewer
