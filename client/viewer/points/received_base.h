// The base on its way into the model cache.
#pragma once

#include <utility>

#include "client/viewer/points/base_replica.h"
#include "client/viewer/points/model_cache.h"
#include "common/core/log.h"

namespace telesplat::viewer {

class ReceivedBase {
 public:
  static constexpr size_t kLeavesAtOnce = 64;  ///< leaves that one tick puts into the cache: some milliseconds

  /// Keeps a reference to the cache. ask: as BaseReplica takes it.
  ReceivedBase(ModelCache& cache, std::function<void(wire::BaseRequest)> ask)
      : cache_(cache), replica_(std::move(ask)) {}

  void start(double now_s) { replica_.start(now_s); }
  void take(const wire::BaseHidden& hidden, double now_s) { replica_.take(hidden, now_s); }
  void take(const wire::BasePart& part, double now_s) {
    if (const Status s = replica_.take(part, now_s); !s && told_.allow(now_s)) log::warn("{}", s.error().text);
  }
  /// To be called every few milliseconds.
  void tick(double now_s) {
    replica_.tick(now_s);
    if (!replica_.known()) return;
    if (std::exchange(begun_, replica_.number()) != replica_.number()) cache_.begin_base(replica_.config());
    cache_.put_base(replica_.take_changes(kLeavesAtOnce));
  }

 private:
  ModelCache& cache_;
  BaseReplica replica_;
  uint64_t begun_ = 0;  // BaseReplica::number() of the base in the cache
  log::RateLimiter told_;
};

}  // namespace telesplat::viewer
