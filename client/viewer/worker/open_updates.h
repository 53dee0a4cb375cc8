// View updates on their way: those whose answers were lost, and complete ones that wait for earlier ones.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "client/viewer/coupling/view_requester.h"

namespace telesplat::viewer {

/// Used by one thread.
class OpenUpdates {
 public:
  /// The answer cannot be used.
  void on_lost(RequestId request) { lost_.push_back(request); }
  /// The servers know of no open request.
  void on_all_lost() { all_lost_ = true; }
  /// The requests of `open` to send again, beside those that are `overdue`.
  std::vector<RequestId> take_lost(const Coupling& open, std::vector<RequestId> overdue) {
    for (const RequestId request : std::exchange(lost_, {}))
      if (open.is_open(request)) overdue.push_back(request);
    return std::exchange(all_lost_, false) ? open.open() : overdue;
  }

  void on_complete(const ShownUpdate& update) { complete_[update.request] = update; }
  /// Returns the update, and drops it and those before it.
  ShownUpdate release(RequestId request) {
    const ShownUpdate out = complete_[request];
    complete_.erase(complete_.begin(), complete_.upper_bound(request));
    return out;
  }
  std::map<RequestId, ShownUpdate> take_complete() { return std::exchange(complete_, {}); }

 private:
  std::map<RequestId, ShownUpdate> complete_;
  std::vector<RequestId> lost_;  // some may have been answered since
  bool all_lost_ = false;
};

}  // namespace telesplat::viewer
