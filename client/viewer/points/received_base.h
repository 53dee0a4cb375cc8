// The base on its way into the model cache.
#pragma once

#include <utility>

#include "client/viewer/points/base_replica.h"
#include "client/viewer/points/model_cache.h"
#include "common/core/log.h"

namespace telesplat::viewer {

class ReceivedBase {
 public:
  /// Keeps a reference to the cache. ask: as BaseReplica takes it.
  ReceivedBase(ModelCache& cache, std::function<void(wire::BaseRequest)> ask)
      : cache_(cache), replica_(std::move(ask)) {}

  void expect(uint64_t most) { replica_.expect(most); }
  bool known() const { return replica_.known(); }
  void start(double now_s) { replica_.start(now_s); }
  void take(const wire::BaseBegin& begin, double now_s) { replica_.take(begin, now_s); }
  void take(const wire::BaseTree& tree, double now_s) { replica_.take(tree, now_s); }
  void take(const wire::BaseHidden& hidden, double now_s) { replica_.take(hidden, now_s); }
  /// False: it is refused.
  bool take(const wire::BasePart& part, double now_s) {
    const Status s = replica_.take(part, now_s);
    if (!s && told_.allow(now_s)) log::warn("{}", s.error().text);
    return s.ok();
  }
  std::vector<uint32_t> take_dropped() { return replica_.take_dropped(); }
  /// To be called every few milliseconds. True: the base in the cache has changed.
  bool tick(double now_s) {
    replica_.tick(cache_.viewpoint(), now_s);
    if (std::exchange(shown_, replica_.changes()) == replica_.changes()) return false;
    return cache_.set_base(replica_.mesh());
  }

 private:
  ModelCache& cache_;
  BaseReplica replica_;
  uint64_t shown_ = 0;  // BaseReplica::changes() of the base in the cache
  log::RateLimiter told_;
};

}  // namespace telesplat::viewer
