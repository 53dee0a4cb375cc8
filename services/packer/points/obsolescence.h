// Chooses clusters to forget (T4.3.3): those that no viewer drew for long, then the least recently drawn while there
// are too many points.
#pragma once

#include <unordered_map>
#include <vector>

#include "services/packer/points/event_log.h"

namespace telesplat::packer {

class Obsolescence {
 public:
  /// A cluster was drawn, or got points. An older time than the last is ignored.
  void accessed(points::ClusterKey key, double now_s);
  void forgotten(points::ClusterKey key) { access_s_.erase(key); }
  void clear() { access_s_.clear(); }
  bool knows(points::ClusterKey key) const { return access_s_.count(key) != 0; }
  /// True if the cluster was drawn, or got points, at that time or later.
  bool accessed_since(points::ClusterKey key, double since_s) const {
    const auto found = access_s_.find(key);
    return found != access_s_.end() && found->second >= since_s;
  }

  /// Returns the clusters not accessed for more than `after_s`; then, if the rest has more than max_points points (0 =
  /// no limit), the least recently accessed ones (among equals, the lowest keys) until at most 90 % of max_points are
  /// left. Ascending.
  std::vector<points::ClusterKey> choose(const points::PointModel& model, double now_s, double after_s,
                                         uint64_t max_points) const;

  /// Returns every cluster of the least recently accessed patches, until the patches left have at most 90 % of
  /// max_bytes; empty if they have at most max_bytes. Ascending.
  std::vector<points::ClusterKey> choose_patches(const EventLog& log, uint64_t max_bytes) const;

 private:
  std::unordered_map<points::ClusterKey, double> access_s_;  // last access of every cluster of the model
};

// Chooses patches of clusters to forget where packing keeps redundant ones (T7.3): those that no viewer drew for long,
// and those coarser than others of their cluster.

/// A patch within a cluster: the cluster's mosaics with that frame tag.
struct PatchKey {
  points::ClusterKey cluster = 0;
  uint32_t frame = 0;
  auto operator<=>(const PatchKey&) const = default;
};

struct PatchLimits {
  double obsolete_after_s = 0;       ///< forget patches not drawn for longer; 0: never
  uint32_t patches_per_cluster = 0;  ///< at most; 0: no limit
  uint64_t max_points = 0;           ///< above it, forget until at most 90 % of it are left; 0: no limit
};

class PatchObsolescence {
 public:
  /// A patch got points in a cluster; this counts as being drawn.
  void added(points::ClusterKey key, const points::Mosaic& mosaic, double now_s);
  /// A patch was drawn; unknown ones are ignored. An older time than the last is ignored.
  void accessed(const PatchKey& key, double now_s);
  /// Every patch of a cluster was drawn.
  void accessed(points::ClusterKey key, double now_s);
  void forgotten(const PatchKey& key);
  void clear();

  /// Returns the patches to forget, ascending: first those not drawn for longer than obsolete_after_s; then those by
  /// which a cluster exceeds patches_per_cluster; then more while there are too many points. Highest scores go first:
  ///     score = seconds since it was drawn + 4 * max(0, log2(best pixel range / its pixel range)),
  /// with the best pixel range of the cluster's patches that are not obsolete; at equal scores the older patch, then
  /// the lower key.
  std::vector<PatchKey> choose(const PatchLimits& limits, double now_s) const;

  /// Returns every patch of the least recently drawn events, until the events left have at most 90 % of max_bytes;
  /// empty if they have at most max_bytes. Ascending.
  std::vector<PatchKey> choose_events(const points::PointModel& model, const EventLog& log, uint64_t max_bytes) const;

 private:
  struct Patch {
    uint32_t frame, points;
    float pixel_range;
    Sequence first;  // sequence of its first mosaic
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
