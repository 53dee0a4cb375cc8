// Shows the progress of a command on stderr while it works.
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>

namespace telesplat::tools {

/// Estimates the time left of stages of work. Each runs from 0 to 1 at about an even pace and is judged by itself.
class TimeLeft {
 public:
  /// "reading a.ply 43 %, 12 s left": the time only if it is more than five seconds and the pace is known.
  std::string text(const std::string& stage, double fraction, double now_s);

 private:
  struct Begin {
    double at_s, fraction, last;  ///< last: the fraction of the last call
  };
  std::map<std::string, Begin> begins_;
};

/// "12 s", "3 min", "2 h 5 min"
std::string duration_text(double seconds);

/// True if the user wants the work to end.
using ShouldStop = std::function<bool()>;

/// On a terminal one line that rewrites itself, at most 10 times a second; elsewhere one line every 5 seconds. Any
/// thread may call.
class ProgressLine {
 public:
  /// first_after_s: seconds until it first shows, for work that is often over by then.
  explicit ProgressLine(double first_after_s = 0);
  ~ProgressLine() { close(); }

  void show(const std::string& text);
  /// "WHAT 43 %, 12 s left"
  void show(const char* what, double fraction);
  /// Prints a line that stays.
  void line(const std::string& text);
  /// Ends the open line; later output begins a new one.
  void close();

 private:
  std::mutex mutex_;
  TimeLeft time_left_;
  bool terminal_, open_ = false;
  double begin_s_, last_s_;
};

}  // namespace telesplat::tools
