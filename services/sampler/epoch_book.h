// A sampler's memory of a session's epochs: each lease names its epoch, and may come before the epoch's welcome.
#pragma once

#include <map>

#include "common/core/log.h"
#include "services/sampler/work.h"

namespace telesplat::sampler {

inline constexpr size_t kEpochs = 8;          ///< epochs that are remembered, the newest ones
inline constexpr double kUnknownEpoch_s = 1;  ///< a lease waits this long for its epoch's welcome

template <class T>
class EpochBook {
 public:
  /// Sets the master whose epochs come now. With another master the same number is another epoch: then all are
  /// forgotten. True: it is another master.
  bool follow(InstanceId master) {
    const bool another = master != master_;
    if (another) epochs_.clear();
    master_ = master;
    return another;
  }

  /// Null: the epoch is not known, or forgotten. Valid until put() or follow().
  const T* find(EpochId epoch) const {
    const auto found = epochs_.find(epoch);
    return found == epochs_.end() ? nullptr : &found->second;
  }
  void put(EpochId epoch, T what) {
    epochs_.insert_or_assign(epoch, std::move(what));
    while (epochs_.size() > kEpochs) epochs_.erase(epochs_.begin());
  }

  bool empty() const { return epochs_.empty(); }
  /// Precondition of both: not empty.
  EpochId newest_id() const { return epochs_.rbegin()->first; }
  const T& newest() const { return epochs_.rbegin()->second; }

  /// For a lease whose epoch is not known: it waits for kUnknownEpoch_s, then it is hopeless.
  static Readiness wait_for_welcome(EpochId epoch, double received_s, double now_s) {
    const double until_s = received_s + kUnknownEpoch_s;
    if (now_s < until_s) return {Readiness::State::kWaits, until_s};
    log::warn("a lease of epoch {} was dropped: no welcome told of it", epoch.value);
    return {Readiness::State::kHopeless};
  }

 private:
  InstanceId master_;
  std::map<EpochId, T> epochs_;
};

}  // namespace telesplat::sampler
