// Counts rows of viewers that never reached the record: what they say that they have sent, against what came. Of
// frames.csv the numbers of frames tell it (Measured).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "common/metrics/process.h"

namespace telesplat::metrics {

class RowLosses {
 public:
  static constexpr size_t kMostKept = 512;  ///< viewers and tables; of further ones no loss is known
  static constexpr double kMostLost = 1e6;  ///< at once: a larger step is no loss but another count

  void came(const Process& viewer, const std::string& table, uint64_t rows) {
    if (Rows* r = rows_of(viewer, table)) r->came += double(rows);
  }
  /// sent: in its life, before it says this, over the same connection. What a viewer sent before it said so first is
  /// another record's.
  void told(const Process& viewer, const std::string& table, double sent) {
    Rows* r = rows_of(viewer, table);
    if (!r || !(sent >= 0)) return;
    const double missing = sent - r->came, more = missing - r->missing.value_or(missing);
    if (more > 0 && more <= kMostLost) lost_[table] += uint64_t(more);
    r->missing = missing;
  }
  /// By table.
  const std::map<std::string, uint64_t>& lost() const { return lost_; }

 private:
  struct Rows {
    uint64_t pid = 0;
    double came = 0;
    std::optional<double> missing;  // as it was told last
  };
  Rows* rows_of(const Process& viewer, const std::string& table) {
    const std::pair key(viewer.name, table);
    if (rows_.size() >= kMostKept && !rows_.contains(key)) return nullptr;
    Rows& out = rows_[key];
    if (out.pid != viewer.pid) out = {viewer.pid, 0, {}};
    return &out;
  }

  std::map<std::pair<std::string, std::string>, Rows> rows_;
  std::map<std::string, uint64_t> lost_;
};

}  // namespace telesplat::metrics
