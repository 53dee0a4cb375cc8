// What a command tells on stderr while it works.
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>

namespace telesplat::tools {

/// Stages of work, each from 0 to 1 at about the same pace. Each is judged by itself.
class TimeLeft {
 public:
  /// "reading a.ply 43 %, 12 s left": the time only where it is more than five seconds and something is known of it.
  std::string text(const std::string& stage, double fraction, double now_s);

 private:
  struct Begin {
    double at_s, fraction, last;  ///< last: the fraction that was told last
  };
  std::map<std::string, Begin> begins_;
};

/// "12 s", "3 min", "2 h 5 min"
std::string duration_text(double seconds);

/// Whether the person wants an end to it.
using ShouldStop = std::function<bool()>;

/// On a terminal one line that rewrites itself, at most 10 times a second; elsewhere one line every 5 seconds. Any
/// thread may call.
class ProgressLine {
 public:
  /// first_after_s: nothing is shown before that many seconds, for work that is often over by then.
  explicit ProgressLine(double first_after_s = 0);
  ~ProgressLine() { close(); }

  void show(const std::string& text);
  /// "WHAT 43 %, 12 s left"
  void show(const char* what, double fraction);
  /// A line that stays.
  void line(const std::string& text);
  /// Ends the line that is open; what follows begins a new one.
  void close();

 private:
  std::mutex mutex_;
  TimeLeft time_left_;
  bool terminal_, open_ = false;
  double begin_s_, last_s_;
};

}  // namespace telesplat::tools
