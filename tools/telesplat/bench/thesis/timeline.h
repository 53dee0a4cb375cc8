// A workflow timeline as the thesis's figures 6.1 to 6.3 have it, drawn from the trace.json of a run.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::launcher {

struct TimelineSpan {
  std::string name;
  double begin_s = 0, end_s = 0;
};

/// What one thread of one process did.
struct TimelineLane {
  std::string process, lane;        ///< lane: its name; where the file has none, those of its spans
  std::vector<TimelineSpan> spans;  ///< by begin
};

/// Complete and asynchronous events of a file in the Chrome trace format, a list or an object with traceEvents, by the
/// names of their processes. Error: it cannot be read, or is none.
Result<std::vector<TimelineLane>> read_timeline(const std::string& path);

struct TimeSpan {
  double begin_s, end_s;
};
/// A part in which everything has settled: from 60 % of the trace on, four median view updates long, within 0.2 to 3 s.
TimeSpan steady_part(const std::vector<TimelineLane>& lanes);

/// The lanes between two moments, one below the other, as a picture that stands alone.
std::string timeline_svg(const std::vector<TimelineLane>& lanes, const TimeSpan& part, const std::string& title);

}  // namespace telesplat::launcher
