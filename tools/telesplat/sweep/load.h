// How busy a machine was while a run was measured, and with what.
#pragma once

#include <optional>
#include <string>

namespace telesplat::launcher {

struct Load {
  double before = 0, after = 0;  ///< processes that ran or wanted to, mean of a minute (/proc/loadavg)
  double own_cpu = 0;            ///< 0..1 of all cores: the run's processes, this one included
  double others_cpu = 0;         ///< 0..1 of all cores: whatever else the machine did
};

/// Seconds that all cores together were busy since the machine started, from the text of /proc/stat; nothing: it is
/// none. ticks_per_s: sysconf(_SC_CLK_TCK).
std::optional<double> busy_seconds(const std::string& stat, double ticks_per_s);
/// The first number of /proc/loadavg.
std::optional<double> mean_load(const std::string& loadavg);

/// The share of `cores` that others used within elapsed_s: what all cores did, without what this run did; 0 to 1.
double others_share(double busy_s, double own_s, double elapsed_s, int cores);

/// Measures from its making on.
class LoadMeter {
 public:
  LoadMeter();
  /// Until now. Child processes count once they, and theirs, have ended and been waited for.
  Load measured() const;

 private:
  double begin_s_, load_, busy_s_, own_s_;
};

}  // namespace telesplat::launcher
