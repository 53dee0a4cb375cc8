// Samplers that wait for leases, in the order in which they are served.
#pragma once

#include <deque>
#include <string>
#include <unordered_set>

namespace telesplat::master {

inline constexpr int kMaxWaitingLeases = 64;  ///< lease requests of one sampler that wait

class Idle {
 public:
  struct Sampler {
    std::string id;   ///< routing id
    int waiting = 0;  ///< its lease requests that are not answered; above 0
    int at_once = 0;  ///< leases that it takes at a time: it holds no lease when it waits for all of them; 0: unknown
    /// True if it reported that it holds no lease, though the packer may not have reported its last tiles yet.
    bool holds_none() const { return at_once > 0 && waiting >= at_once; }
  };

  /// Adds a lease request. False: it was dropped, kMaxWaitingLeases of this sampler wait.
  bool add(const std::string& id, int at_once);
  void remove(const std::string& id);

  bool empty() const { return samplers_.empty(); }
  size_t size() const { return samplers_.size(); }
  const Sampler& operator[](size_t i) const { return samplers_[i]; }
  auto begin() const { return samplers_.begin(); }
  auto end() const { return samplers_.end(); }

  /// Sampler i was given a lease. If it waits for more, it is served after all others.
  void served(size_t i);
  /// Likewise, but it keeps its place. False: it does not wait for more; the next sampler has its place now.
  bool served_in_place(size_t i);

 private:
  void erase(size_t i);

  // Each sampler once; mostly the one at the front is served. ids_ knows who is here without a search: with 1,000
  // samplers (bench master_leases) rows are leased in 6.5 ms instead of 16 ms.
  std::deque<Sampler> samplers_;
  std::unordered_set<std::string> ids_;
};

}  // namespace telesplat::master
