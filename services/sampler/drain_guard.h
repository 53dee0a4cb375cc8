// Makes a sampler that is told to stop end in time, even in the middle of a lease that never ends.
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "common/core/ids.h"
#include "common/net/keys/access.h"

namespace telesplat::sampler {

/// A sampler begins no lease later than this after it was told to stop.
inline constexpr double kDrain_s = 0.8;
/// This long after it was told to stop it ends, in the middle of anything: its manager may kill it after two seconds.
inline constexpr double kStop_s = 1.3;

class DrainGuard {
 public:
  /// From then on watches net::stop_requested(). If the process still runs kStop_s after it was told to stop, says
  /// goodbye to the master in the name of `instance`, so that its leases go to others at once, and ends the process
  /// with code 0.
  DrainGuard(const std::string& master, InstanceId instance, net::Access access = {});
  ~DrainGuard();

 private:
  void watch(const std::string& master, InstanceId instance, const net::Access& access);

  std::mutex mutex_;
  std::condition_variable wake_;
  bool done_ = false;
  std::thread thread_;
};

}  // namespace telesplat::sampler
