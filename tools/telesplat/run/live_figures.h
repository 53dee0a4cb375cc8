// The line of figures that a person sees during a run.
#pragma once

#include <sys/types.h>

#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace telesplat::launcher {

/// Rates of the last seconds from the master's status answers. Processes report their counters once a second, and the
/// launcher asks at other times: so a rate is the count between two reports of a process, divided by the time between
/// them.
class SessionFigures {
 public:
  /// Takes a status answer that came at now_s. Returns the line: frames and updates a second of a viewer (the mean over
  /// living viewers), points, bytes a second of all viewers; empty until a viewer that displays has sent two reports.
  std::string update(const nlohmann::json& status, double now_s);

 private:
  struct Report {
    double at_s = 0;  // on the reporter's clock if it sends that, else when its counters were first seen
    double frames = 0, updates = 0, bytes = 0;
  };
  struct Viewer {
    nlohmann::json values;       // those of the newest report
    double heard_s = 0;          // when they were first seen here
    std::deque<Report> reports;  // from the window's begin to the newest
    double rate(double Report::*counter) const;
  };
  void take(Viewer& viewer, const nlohmann::json& values, double now_s);

  std::map<std::string, Viewer> viewers_;  // by name and process id
};

/// Totals of each viewer, a line each, from a status answer: for a session that another launcher records. names: the
/// viewers'.
std::vector<std::string> viewer_results(const nlohmann::json& status, const std::vector<std::string>& names);

/// Measures if this machine is too busy for a process: its wait for a processor, as the kernel counts it.
class ProcessorWait {
 public:
  /// Share of its time; above it a person is warned.
  static constexpr double kMuch = 0.1;

  /// Call it now and then, while the process runs. Its main thread counts: in a viewer that one displays.
  void look(pid_t process, double now_s);
  /// Share of the time from the first look to the last one; 0 if the kernel does not count it.
  double share() const { return last_s_ > first_s_ ? (last_waited_s_ - first_waited_s_) / (last_s_ - first_s_) : 0; }

 private:
  double first_s_ = 0, last_s_ = 0, first_waited_s_ = 0, last_waited_s_ = 0;
};

}  // namespace telesplat::launcher
