#include "services/packer/points/obsolescence.h"

#include <algorithm>

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
  // Times ascend: first those that are obsolete, then, if there are too many points, the next ones.
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

}  // namespace telesplat::packer
