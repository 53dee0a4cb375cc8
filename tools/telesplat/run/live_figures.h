// The line of figures that a person sees while a run goes on.
#pragma once

#include <sys/types.h>

#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace telesplat::launcher {

/// Rates of the last seconds from the master's status answers. Processes report their counters once a second, and the
/// launcher asks when it likes: so a rate is what a process counted between two of its own reports, divided by the time
/// between those reports.
class SessionFigures {
 public:
  /// Takes a status answer that came at now_s. Returns the line: frames and updates a second of a viewer (the mean of
  /// those that are alive), points, bytes a second of all viewers; empty before there are two reports of a viewer that
  /// displayed something.
  std::string update(const nlohmann::json& status, double now_s);

 private:
  struct Report {
    double at_s = 0;  // on the reporter's clock if it tells, else when its counters were first seen
    double frames = 0, updates = 0, bytes = 0;
  };
  struct Viewer {
    nlohmann::json values;       // of the newest report
    double heard_s = 0;          // when they were first seen here
    std::deque<Report> reports;  // from the window's begin to the newest
    double rate(double Report::*counter) const;
  };
  void take(Viewer& viewer, const nlohmann::json& values, double now_s);

  std::map<std::string, Viewer> viewers_;  // by name and process id
};

/// What viewers did in all, a line each, from a status answer: for a session whose record is another's. names: of the
/// viewers.
std::vector<std::string> viewer_results(const nlohmann::json& status, const std::vector<std::string>& names);

/// Whether this machine is too busy for a process: how long it waited for a processor, as the kernel counts it.
class ProcessorWait {
 public:
  /// Of its time from which on a person is told.
  static constexpr double kMuch = 0.1;

  /// Now and then, while the process runs. Its main thread counts: a viewer's displays.
  void look(pid_t process, double now_s);
  /// Share of the time from the first look to the last one; 0 where the kernel does not tell.
  double share() const { return last_s_ > first_s_ ? (last_waited_s_ - first_waited_s_) / (last_s_ - first_s_) : 0; }

 private:
  double first_s_ = 0, last_s_ = 0, first_waited_s_ = 0, last_waited_s_ = 0;
};

}  // namespace telesplat::launcher
