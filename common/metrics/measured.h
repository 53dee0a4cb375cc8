// What a run has measured so far, in memory: what its summary is made from.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/metrics/plans/plan_row.h"
#include "common/wire/session_messages.h"
#include "common/wire/tile_messages.h"

namespace telesplat::metrics {

/// Rows of numbers from all viewers, with the columns of the first that sent some.
struct Rows {
  std::vector<std::string> columns;
  std::vector<double> values;     ///< row after row
  std::vector<uint32_t> viewers;  ///< of each row: whose, in Measured::viewers

  /// All values of one column; none if there is no such column.
  std::vector<double> column(const std::string& name) const;
};

struct Measured {
  Rows frames, updates, stages;
  std::vector<std::string> viewers;  ///< names of those that sent rows
  std::vector<wire::TileDone> tiles;
  std::vector<PlanRow> plans;
  std::map<std::string, double> busy_s;  ///< sample begin to encode end, by sampler
  size_t epochs = 0;

  /// "frames", "updates" or "stages"; null for other names.
  Rows* table(const std::string& name);
  /// Refuses, and keeps nothing of, rows whose shape does not fit. Precondition: table(more.table).
  Status add(const std::string& viewer, const wire::MetricRows& more);
};

}  // namespace telesplat::metrics
