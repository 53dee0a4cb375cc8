#include "services/master/slabs/wall_views.h"

#include <algorithm>

namespace telesplat::master {
namespace {

constexpr size_t kMaxWalls = 64;  // others' views are sampled as they come

}  // namespace

void WallViews::on(const wire::ViewRequest& view) {
  const double now_s = view.moments.received_s;
  if (walls_.size() >= kMaxWalls && !walls_.contains(view.wall)) return;
  const auto [place, fresh] = walls_.try_emplace(view.wall);
  Wall& wall = place->second;
  if (fresh) wall.first_s = wall.since_s = now_s, wall.ask = view.ask;
  wall.viewers = view.wall_viewers;
  // One that comes while the others have frames has not heard of what they ask for.
  Member& member = wall.members.try_emplace(view.viewer, Member{.waited_for = !wall.under_way}).first->second;
  if (!member.since_s) member.since_s = now_s;
  // Views of viewers' own heads are together until there are some of one head.
  const bool next = view.ask > wall.ask || (view.ask == 0 && wall.ask == 0 && wall.begun);
  if (!next) return;
  wall.ask = view.ask;
  wall.since_s = now_s;
  wall.begun = false;
}

void WallViews::forget(InstanceId viewer) {
  for (auto& [name, wall] : walls_) wall.members.erase(viewer);
  std::erase_if(walls_, [](const auto& w) { return w.second.members.empty(); });
}

bool WallViews::ready(const wire::ViewRequest& view, const Waiting& waiting, double now_s) const {
  const auto found = walls_.find(view.wall);
  if (found == walls_.end()) return true;
  const Wall& wall = found->second;
  if (wall.begun || view.ask != wall.ask) {
    const auto own = wall.members.find(view.viewer);
    return own == wall.members.end() || now_s >= own->second.since_s.value_or(now_s) + kLeftOver_s;
  }
  if (wall.members.size() < wall.viewers && now_s < wall.first_s + kGather_s) return false;
  if (now_s >= wall.since_s + kTogether_s) return true;
  return std::all_of(wall.members.begin(), wall.members.end(), [&](const auto& m) {
    const wire::ViewRequest* own = waiting(m.first);
    return !m.second.waited_for || (own && own->wall == view.wall && own->ask == wall.ask);
  });
}

void WallViews::begun(const std::vector<wire::ViewRequest>& views) {
  const auto found = walls_.find(views.front().wall);
  if (found == walls_.end()) return;
  Wall& wall = found->second;
  for (const auto& v : views)
    if (const auto m = wall.members.find(v.viewer); m != wall.members.end()) m->second.since_s.reset();
  if (wall.begun || wall.ask != views.front().ask) return;
  wall.begun = wall.under_way = true;
  for (auto& [viewer, member] : wall.members) {
    const bool in_time =
        std::any_of(views.begin(), views.end(), [&name = viewer](const auto& v) { return v.viewer == name; });
    member.in_time = in_time ? member.in_time + 1 : 0;
    member.waited_for = in_time && (member.waited_for || member.in_time >= kInTime);
  }
}

void WallViews::dropped(const std::vector<wire::ViewRequest>& views) {
  for (const auto& v : views)
    if (const auto found = walls_.find(v.wall); found != walls_.end() && found->second.ask == v.ask)
      found->second.begun = false;
}

}  // namespace telesplat::master
