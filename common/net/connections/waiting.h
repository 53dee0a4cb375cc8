// Reports to people what a process waits for: in a line after some seconds, then once a minute.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>

namespace telesplat::net {

class Waiting {
 public:
  static constexpr double kGrace_s = 3;   ///< for each new cause, before the first line about it
  static constexpr double kEvery_s = 60;  ///< between two lines about the same cause

  /// most_s: after waiting for longer a process gives up; 0: never.
  explicit Waiting(double most_s = 0) : most_s_(most_s) {}

  /// what: what the process waits for now, a sentence without its full stop; empty: for nothing. Returns the line that
  /// is due.
  std::optional<std::string> look(const std::string& what, double now_s);
  /// Seconds that it has waited, for one cause or another.
  double waited_s(double now_s) const { return since_s_ ? now_s - *since_s_ : 0; }
  bool gives_up(double now_s) const { return most_s_ > 0 && waited_s(now_s) >= most_s_; }
  double most_s() const { return most_s_; }

 private:
  double most_s_;
  std::string what_;
  std::set<std::string> told_;
  std::optional<double> since_s_;
  double what_since_s_ = 0, told_s_ = -1e9;
};

/// Returns "the session has no data server and no sampler" for "data,sampler", the roles that a master says its session
/// lacks; empty for none.
std::string lacking_text(std::string_view roles);

/// Returns why the host of tcp://HOST:PORT is not found; empty if it is, or the endpoint has no host. May take seconds.
std::string host_problem(const std::string& endpoint);

/// Searches like host_problem(), in a thread of its own.
class HostSearch {
 public:
  explicit HostSearch(std::string endpoint) : endpoint_(std::move(endpoint)) {}
  /// Begins a search, unless one is under way or began less than half a minute ago.
  void begin();
  /// Result of the last finished search.
  std::string problem() const;

 private:
  struct Found;
  std::string endpoint_;
  std::shared_ptr<Found> found_;
};

}  // namespace telesplat::net
