#include "common/metrics/recorder.h"

#include <algorithm>

#include "common/core/check.h"

namespace telesplat::metrics {
namespace {
constexpr size_t kMaxBuffered = 1u << 20;  // values kept while the master is away; newer ones are dropped
}

void TableRecorder::add(std::span<const double> row) {
  CHECK(row.size() == columns_.size());
  const std::lock_guard lock(mutex_);
  if (values_.size() < kMaxBuffered)
    values_.insert(values_.end(), row.begin(), row.end());
  else
    ++gone_;
}

std::optional<wire::MetricRows> TableRecorder::flush(InstanceId instance) {
  const std::lock_guard lock(mutex_);
  if (values_.empty()) return std::nullopt;
  gone_ += values_.size() / columns_.size();
  wire::MetricRows out{instance, table_, columns_, std::move(values_)};
  values_.clear();
  return out;
}

void SpanRecorder::add(const char* name, double begin_s, double end_s, int lane, const SpanOf& of) {
  const std::lock_guard lock(mutex_);
  if (values_.size() >= kMaxBuffered) return;
  auto it = std::find(names_.begin(), names_.end(), name);
  if (it == names_.end()) it = names_.insert(it, name);
  values_.insert(values_.end(), {static_cast<double>(it - names_.begin()), begin_s, end_s, static_cast<double>(lane),
                                 of.frame, of.tile, of.request});
}

std::optional<wire::MetricRows> SpanRecorder::flush(InstanceId instance) {
  const std::lock_guard lock(mutex_);
  if (values_.empty()) return std::nullopt;
  wire::MetricRows out{instance, "spans", names_, std::move(values_)};
  values_.clear();
  return out;
}

}  // namespace telesplat::metrics
