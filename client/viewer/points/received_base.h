// The base on its way into the model cache.
#pragma once

#include <optional>
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

  void expect(bool base) { replica_.expect(base); }
  bool known() const { return replica_.known(); }
  void start(double now_s) { replica_.start(now_s); }
  void take(const wire::BaseHidden& hidden, double now_s) { replica_.take(hidden, now_s); }
  void take(const wire::BasePart& part, double now_s) {
    if (const Status s = replica_.take(part, now_s); !s && told_.allow(now_s)) log::warn("{}", s.error().text);
  }
  /// To be called every few milliseconds. True: the base in the cache has changed.
  bool tick(double now_s) {
    const uint64_t before = cache_.summaries_made();
    replica_.tick(now_s);
    if (begun_ && *begun_ != replica_.number()) {
      cache_.end_base();
      begun_.reset();
    }
    if (replica_.known()) {
      if (!begun_) cache_.begin_base(replica_.config());
      begun_ = replica_.number();
      cache_.put_base(replica_.take_changes(kLeavesAtOnce));
    }
    return cache_.summaries_made() != before;
  }

 private:
  ModelCache& cache_;
  BaseReplica replica_;
  std::optional<uint64_t> begun_;  // BaseReplica::number() of the base in the cache
  log::RateLimiter told_;
};

}  // namespace telesplat::viewer
