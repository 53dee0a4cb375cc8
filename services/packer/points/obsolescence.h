// Which clusters to forget (T4.3.3): by time since anybody drew them, and least recently drawn first where there is too
// much.
#pragma once

#include <unordered_map>
#include <vector>

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

// Which patches of which clusters to forget where packing keeps redundant ones (T7.3): those that nobody drew for long
// and those that are coarse beside others of their cluster.

/// A patch within a cluster: the cluster's mosaics with that frame tag.
struct PatchKey {
  points::ClusterKey cluster = 0;
  uint32_t frame = 0;
  auto operator<=>(const PatchKey&) const = default;
};

struct PatchLimits {
  double obsolete_after_s = 0;       ///< forget what was not drawn for longer; 0: never
  uint32_t patches_per_cluster = 0;  ///< at most; 0: no limit
  uint64_t max_points = 0;           ///< above it, forget until at most 90 % of it are left; 0: no limit
};

class PatchObsolescence {
 public:
  /// A patch got points in a cluster, which counts as being drawn.
  void added(points::ClusterKey key, const points::Mosaic& mosaic, double now_s);
  /// A patch was drawn; unknown ones are ignored. Time never runs backwards for it.
  void accessed(const PatchKey& key, double now_s);
  /// Every patch of a cluster was drawn.
  void accessed(points::ClusterKey key, double now_s);
  void forgotten(const PatchKey& key);
  void clear();

  /// What to forget, ascending: first the patches not drawn for longer than obsolete_after_s; then those by which a
  /// cluster has more than patches_per_cluster; then more while there are too many points. The order is that of falling
  ///   score = seconds since it was drawn + 4 * max(0, log2(best pixel range / its pixel range)),
  /// with the best pixel range of the cluster's patches that are not obsolete. At equal scores the older patch goes
  /// first, then the lower key.
  std::vector<PatchKey> choose(const PatchLimits& limits, double now_s) const;

  /// Every patch of the least recently drawn events, until the events left have at most 90 % of max_bytes; none if they
  /// have no more than max_bytes. Ascending.
  std::vector<PatchKey> choose_events(const points::PointModel& model, const EventLog& log, uint64_t max_bytes) const;

 private:
  struct Patch {
    uint32_t frame, points;
    float pixel_range;
    Sequence first;  // of its mosaics
    double access_s;
  };
  struct Scored {
    double score;
    Sequence first;
    PatchKey key;
    uint32_t points;
    bool goes_before(const Scored& other) const;
  };
  double score(const Patch& patch, float best_range, double now_s) const;

  std::unordered_map<points::ClusterKey, std::vector<Patch>> clusters_;
  uint64_t points_ = 0;
};

}  // namespace telesplat::packer
