#include "services/packer/points/obsolescence.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace telesplat::packer {

void Obsolescence::accessed(points::ClusterKey key, double now_s) {
  const auto [at, is_new] = access_s_.emplace(key, now_s);
  if (!is_new) at->second = std::max(at->second, now_s);
}

std::vector<points::ClusterKey> Obsolescence::choose(const points::PointModel& model, double now_s, double after_s,
                                                     uint64_t max_points) const {
  std::vector<points::ClusterKey> out;
  uint64_t points = model.points();
  const bool too_many = max_points > 0 && points > max_points;
  if (after_s <= 0 && !too_many) return out;

  std::vector<std::pair<double, points::ClusterKey>> oldest_first;
  for (const auto& [key, access_s] : access_s_) oldest_first.emplace_back(access_s, key);
  std::sort(oldest_first.begin(), oldest_first.end());
  // Times ascend: first come the obsolete clusters, then, if there are too many points, the next ones.
  uint64_t limit = ~uint64_t{0};
  for (const auto& [access_s, key] : oldest_first) {
    if (!(after_s > 0 && now_s - access_s > after_s)) {
      if (limit == ~uint64_t{0} && max_points > 0 && points > max_points)
        limit = max_points / 10 * 9 + max_points % 10 * 9 / 10;
      if (points <= limit) break;
    }
    points -= model.points_in(key);
    out.push_back(key);
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<points::ClusterKey> Obsolescence::choose_patches(const EventLog& log, uint64_t max_bytes) const {
  if (log.patch_bytes() <= max_bytes) return {};
  // A patch was last used when any of its clusters was.
  std::unordered_map<Sequence, double> used_s;
  for (const auto& [key, patches] : log.patches_of_clusters()) {
    const double access_s = access_s_.at(key);
    for (const Sequence patch : patches) {
      const auto [at, is_new] = used_s.emplace(patch, access_s);
      if (!is_new) at->second = std::max(at->second, access_s);
    }
  }
  const std::unordered_set<Sequence> chosen = oldest_patches(used_s, log, max_bytes);
  std::vector<points::ClusterKey> out;
  for (const auto& [key, patches] : log.patches_of_clusters())
    if (std::any_of(patches.begin(), patches.end(), [&](Sequence s) { return chosen.count(s) != 0; }))
      out.push_back(key);
  std::sort(out.begin(), out.end());
  return out;
}

namespace {

constexpr double kHalving_s = 4;  // a halving of the sampling rate below the cluster's best counts as this much age

}  // namespace

void PatchObsolescence::added(points::ClusterKey key, const points::Mosaic& mosaic, double now_s) {
  points_ += mosaic.count(0);
  std::vector<Patch>& patches = clusters_[key];
  for (Patch& p : patches)
    if (p.frame == mosaic.frame_tag()) {
      p.points += mosaic.count(0);
      p.access_s = std::max(p.access_s, now_s);
      return;
    }
  patches.push_back({mosaic.frame_tag(), mosaic.count(0), mosaic.pixel_range(), mosaic.sequence(), now_s});
}

void PatchObsolescence::accessed(const PatchKey& key, double now_s) {
  const auto found = clusters_.find(key.cluster);
  if (found == clusters_.end()) return;
  for (Patch& p : found->second)
    if (p.frame == key.frame) p.access_s = std::max(p.access_s, now_s);
}

void PatchObsolescence::accessed(points::ClusterKey key, double now_s) {
  const auto found = clusters_.find(key);
  if (found == clusters_.end()) return;
  for (Patch& p : found->second) p.access_s = std::max(p.access_s, now_s);
}

void PatchObsolescence::forgotten(const PatchKey& key) {
  const auto found = clusters_.find(key.cluster);
  if (found == clusters_.end()) return;
  std::erase_if(found->second, [&](const Patch& p) {
    if (p.frame != key.frame) return false;
    points_ -= p.points;
    return true;
  });
  if (found->second.empty()) clusters_.erase(found);
}

void PatchObsolescence::clear() {
  clusters_.clear();
  points_ = 0;
}

bool PatchObsolescence::Scored::goes_before(const Scored& other) const {
  return std::tie(other.score, first, key) < std::tie(score, other.first, other.key);
}

double PatchObsolescence::score(const Patch& p, float best_range, double now_s) const {
  const double halvings = std::log2(static_cast<double>(best_range) / static_cast<double>(p.pixel_range));
  return now_s - p.access_s + kHalving_s * std::max(halvings, 0.0);
}

std::vector<PatchKey> PatchObsolescence::choose(const PatchLimits& limits, double now_s) const {
  std::vector<PatchKey> out;
  uint64_t points = points_;
  const auto drop = [&](const Scored& p) {
    points -= p.points;
    out.push_back(p.key);
  };
  std::vector<Scored> of_cluster, left;
  const bool may_be_too_many = limits.max_points > 0 && points_ > limits.max_points;
  for (const auto& [key, patches] : clusters_) {
    // Most of the time no limit applies to a cluster: skip its scores.
    const bool too_many_patches = limits.patches_per_cluster > 0 && patches.size() > limits.patches_per_cluster;
    if (!too_many_patches && !may_be_too_many && !(limits.obsolete_after_s > 0)) continue;
    of_cluster.clear();
    float best_range = 0;
    for (const Patch& p : patches) {
      of_cluster.push_back({0, p.first, {key, p.frame}, p.points});
      if (limits.obsolete_after_s > 0 && now_s - p.access_s > limits.obsolete_after_s) {
        drop(of_cluster.back());
        of_cluster.back().points = 0;  // marks it as dropped; every other patch has points
      } else {
        best_range = std::max(best_range, p.pixel_range);
      }
    }
    for (size_t i = 0; i < patches.size(); ++i)
      if (of_cluster[i].points > 0) of_cluster[i].score = score(patches[i], best_range, now_s);
    std::erase_if(of_cluster, [](const Scored& p) { return p.points == 0; });
    size_t first_left = 0;
    if (limits.patches_per_cluster > 0 && of_cluster.size() > limits.patches_per_cluster) {
      first_left = of_cluster.size() - limits.patches_per_cluster;
      std::sort(of_cluster.begin(), of_cluster.end(),
                [](const Scored& a, const Scored& b) { return a.goes_before(b); });
      for (size_t i = 0; i < first_left; ++i) drop(of_cluster[i]);
    }
    if (may_be_too_many)
      left.insert(left.end(), of_cluster.begin() + static_cast<ptrdiff_t>(first_left), of_cluster.end());
  }

  if (limits.max_points > 0 && points > limits.max_points) {
    // A heap, since few of many patches go at a time.
    const uint64_t enough = limits.max_points / 10 * 9 + limits.max_points % 10 * 9 / 10;
    const auto stays_longer = [](const Scored& a, const Scored& b) { return b.goes_before(a); };
    std::make_heap(left.begin(), left.end(), stays_longer);
    while (points > enough && !left.empty()) {
      std::pop_heap(left.begin(), left.end(), stays_longer);
      drop(left.back());
      left.pop_back();
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<PatchKey> PatchObsolescence::choose_events(const points::PointModel& model, const EventLog& log,
                                                       uint64_t max_bytes) const {
  if (log.patch_bytes() <= max_bytes) return {};
  // An event was last drawn when any of its mosaics' patches was.
  std::unordered_map<Sequence, double> drawn_s;
  for (const auto& [key, cluster] : model.clusters()) {
    const std::vector<Patch>& patches = clusters_.at(key);
    for (const points::Mosaic& m : cluster->mosaics) {
      const auto patch =
          std::find_if(patches.begin(), patches.end(), [&](const Patch& p) { return p.frame == m.frame_tag(); });
      const auto [at, is_new] = drawn_s.emplace(m.sequence(), patch->access_s);
      if (!is_new) at->second = std::max(at->second, patch->access_s);
    }
  }
  const std::unordered_set<Sequence> chosen = oldest_patches(drawn_s, log, max_bytes);
  std::vector<PatchKey> out;
  for (const auto& [key, cluster] : model.clusters())
    for (const points::Mosaic& m : cluster->mosaics)
      if (chosen.count(m.sequence())) out.push_back({key, m.frame_tag()});
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace telesplat::packer
