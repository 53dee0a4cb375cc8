// stages.csv (docs/metrics.md): a row for each complete view update, where its time went. A row waits until a frame has
// shown its update.
#pragma once

#include <map>
#include <optional>

#include "client/viewer/coupling/update_table.h"
#include "common/metrics/recorder.h"

namespace telesplat::viewer {

/// Used by one thread.
class StageTable {
 public:
  StageTable();
  /// The update is complete.
  void complete(const MeasuredUpdate& measured);
  /// A frame that ended at this moment of the master's clock shows this update, and all before it.
  void displayed(RequestId request, double end_s);
  /// The rows that are finished; `all`: also those whose updates no frame has shown.
  std::optional<wire::MetricRows> flush(InstanceId instance, bool all);

 private:
  struct Waiting {
    std::vector<double> row;  // without what the display adds
    double complete_s = 0;
  };
  void finish(std::map<RequestId, Waiting>::iterator end, double shown_s);

  metrics::TableRecorder table_;
  std::map<RequestId, Waiting> waiting_;
};

}  // namespace telesplat::viewer
