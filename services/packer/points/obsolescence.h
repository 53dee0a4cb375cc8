// Which clusters to forget (T4.3.3): by time since anybody drew them, and least recently drawn first where there is too
// much.
#pragma once

#include <unordered_map>

#include "services/packer/points/event_log.h"

namespace telesplat::packer {

class Obsolescence {
 public:
  /// A cluster was drawn, or got points. Time never runs backwards for it.
  void accessed(points::ClusterKey key, double now_s);
  void forgotten(points::ClusterKey key) { access_s_.erase(key); }
  void clear() { access_s_.clear(); }
  bool knows(points::ClusterKey key) const { return access_s_.count(key) != 0; }
  /// It was drawn, or got points, at that time or later.
  bool accessed_since(points::ClusterKey key, double since_s) const {
    const auto found = access_s_.find(key);
    return found != access_s_.end() && found->second >= since_s;
  }

  /// Clusters not accessed for more than `after_s`, and then, if what is left has more than max_points points (0 = no
  /// limit), the least recently accessed ones (of equals, the lowest keys) until at most 90 % of that is left.
  /// Ascending.
  std::vector<points::ClusterKey> choose(const points::PointModel& model, double now_s, double after_s,
                                         uint64_t max_points) const;

  /// Every cluster of the least recently accessed patches, until the patches left have at most 90 % of max_bytes; none
  /// if they have no more than max_bytes. Ascending.
  std::vector<points::ClusterKey> choose_patches(const EventLog& log, uint64_t max_bytes) const;

 private:
  std::unordered_map<points::ClusterKey, double> access_s_;  // of every cluster of the model
};

}  // namespace telesplat::packer
