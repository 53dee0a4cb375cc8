// How long something that tells how far it has come will still take.
#pragma once

#include <map>
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

}  // namespace telesplat::tools
