// Buffers measurements of a process for the master: rows of a table, and spans for the trace. Thread-safe.
#pragma once

#include <atomic>
#include <initializer_list>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/wire/messages.h"

namespace telesplat::metrics {

/// Rows of numbers with fixed columns (docs/metrics.md).
class TableRecorder {
 public:
  TableRecorder(std::string table, std::vector<std::string> columns)
      : table_(std::move(table)), columns_(std::move(columns)) {}
  /// Precondition: row has one value a column.
  void add(std::span<const double> row);
  void add(std::initializer_list<double> row) { add(std::span(row.begin(), row.size())); }
  /// The rows since the last call, if any.
  std::optional<wire::MetricRows> flush(InstanceId instance);
  /// Number of rows that flush() has returned so far, or that were dropped for lack of room.
  uint64_t gone() const { return gone_; }

 private:
  std::string table_;
  std::vector<std::string> columns_;
  std::mutex mutex_;
  std::vector<double> values_;
  std::atomic<uint64_t> gone_{0};
};

/// Values of a row of "spans".
inline constexpr size_t kSpanWidth = 7;

/// Subject of a span; -1: unknown, or several.
struct SpanOf {
  double frame = -1, tile = -1, request = -1;
};
/// Lane of spans that may overlap: their subjects tell them apart.
inline constexpr int kOverlapping = -1;

/// Spans "name, from, to, lane, frame, tile, request" in seconds of the master's clock; lane: number of the process'
/// thread.
class SpanRecorder {
 public:
  void add(const char* name, double begin_s, double end_s, int lane = 0, const SpanOf& of = {});
  std::optional<wire::MetricRows> flush(InstanceId instance);

 private:
  std::mutex mutex_;
  std::vector<std::string> names_;
  std::vector<double> values_;  // rows of kSpanWidth: name index, begin, end, lane, frame, tile, request
};

}  // namespace telesplat::metrics
