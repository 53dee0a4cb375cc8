// Events of trace.json, Chrome's trace format, read as a stream: the file may be large, and its end may be missing.
#pragma once

#include <cstdint>
#include <istream>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace telesplat::launcher {

/// A span. Names and lanes are indices.
struct TraceEvent {
  double begin_us = 0, duration_us = 0;
  uint32_t lane = 0, name = 0;
  int64_t frame = -1, tile = -1, request = -1;  ///< -1: it does not tell
};

struct TraceLane {
  std::string process;  ///< its name, or "pid 123"
  std::string name;     ///< of the lane; empty: nobody told
  int64_t tid = 0;
  bool async = false;  ///< of spans that may overlap (ph "b" and "e"), named by their category
};

struct Trace {
  std::vector<std::string> names;
  std::vector<TraceLane> lanes;
  std::vector<TraceEvent> events;  ///< by begin
  size_t left_out = 0;             ///< events above the limit, or that make no sense
  size_t open = 0;                 ///< async spans without an end
  bool whole = true;               ///< the file ended as JSON does
};

/// Complete events (ph "X"), async spans (ph "b" and "e" with id and cat) and names (ph "M": process_name,
/// thread_name), in a list or in an object's traceEvents. Others are ignored. Text is made valid UTF-8, names have at
/// most 200 bytes; beyond 10 000 names or lanes all others are one.
Trace read_trace(std::istream& in, size_t most_events = 20'000'000);

/// Which events a page holds: all of them, or those of some windows of the run.
struct TraceWindows {
  std::vector<std::pair<double, double>> windows_us;
  std::vector<size_t> events;  ///< indices
  bool all = true;
};

/// At most `most` events: all, or those that touch one of `windows` windows, whose middles are evenly spaced from
/// begin_us to end_us. A window is as long as the distance to the next, or as much shorter as it
/// takes for it to have no more than its share of the events.
TraceWindows choose_windows(const std::vector<TraceEvent>& events, double begin_us, double end_us, size_t most,
                            size_t windows);

}  // namespace telesplat::launcher
