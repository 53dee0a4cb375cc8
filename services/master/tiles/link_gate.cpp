#include "services/master/tiles/link_gate.h"

#include <algorithm>

namespace telesplat::master {

void LinkGate::report(const wire::LinkReport& told, double now_s) {
  auto [found, is_new] = links_.try_emplace(told.viewer);
  Link& link = found->second;
  if (is_new) link.wished_s = now_s;
  link.told = told;
  link.told_s = now_s;
  link.since_bytes = 0;  // the packer says it in the order in which it publishes
}

double LinkGate::wished_backlog(const Link& link, double now_s) const {
  return std::max(0.0, link.wished_bytes - most_bytes_s_ * (now_s - link.wished_s));
}

void LinkGate::published(uint64_t bytes, uint64_t rays, double now_s, Rays which) {
  if (rays > 0 && bytes > 0) (which == Rays::kAll ? bytes_of_all_ : bytes_a_ray_).add(double(bytes) / double(rays));
  for (auto& [viewer, link] : links_) {
    link.since_bytes += double(bytes);
    link.wished_bytes = wished_backlog(link, now_s) + double(bytes);
    link.wished_s = now_s;
  }
}

double LinkGate::rate(const Link& link) const {
  const double measured = kSpeedShare * link.told.rate_bytes_s;
  if (most_bytes_s_ <= 0) return measured;
  return measured > 0 ? std::min(measured, most_bytes_s_) : most_bytes_s_;
}

bool LinkGate::reads(const Link& link, double now_s) const {
  return link.backlog() == 0 || now_s - link.told_s + link.told.oldest_s < kSilent_s;
}

bool LinkGate::has_room(const Link& link, bool extra, double now_s) const {
  const double queue_s = extra ? 0 : kQueue_s;
  if (most_bytes_s_ > 0 && wished_backlog(link, now_s) > most_bytes_s_ * queue_s) return false;
  const double rate = link.told.rate_bytes_s;
  if (rate <= 0) return link.backlog() <= (extra ? kUnknownExtra : kUnknown);
  return link.backlog() <= std::max(kLeastQueue, rate * (link.told.rtt_s + queue_s));
}

bool LinkGate::open(InstanceId viewer, double now_s) const {
  const auto found = links_.find(viewer);
  return found == links_.end() || (reads(found->second, now_s) && has_room(found->second, false, now_s));
}

bool LinkGate::idle(double now_s) const {
  return std::all_of(links_.begin(), links_.end(),
                     [&](const auto& l) { return !reads(l.second, now_s) || has_room(l.second, true, now_s); });
}

uint64_t LinkGate::update_rays(InstanceId viewer) const {
  const auto found = links_.find(viewer);
  if (found == links_.end() || !bytes_a_ray_.known()) return 0;
  const double bytes_s = rate(found->second);
  if (bytes_s <= 0) return 0;
  return std::max(kLeastRays, uint64_t(std::min(1e9, bytes_s * kUpdate_s / bytes_a_ray_.value())));
}

std::optional<double> LinkGate::takes_s(InstanceId viewer, double rays) const {
  const auto found = links_.find(viewer);
  if (found == links_.end() || !bytes_of_all_.known()) return std::nullopt;
  const double bytes_s = rate(found->second);
  return bytes_s > 0 ? std::optional(rays * bytes_of_all_.value() / bytes_s) : std::nullopt;
}

uint64_t LinkGate::least_update_rays(double now_s) const {
  uint64_t least = 0;
  for (const auto& [viewer, link] : links_)
    if (const uint64_t rays = reads(link, now_s) ? update_rays(viewer) : 0; rays > 0 && (least == 0 || rays < least))
      least = rays;
  return least;
}

bool LinkGate::known() const {
  return links_.empty() ||
         std::any_of(links_.begin(), links_.end(), [](const auto& l) { return l.second.told.rate_bytes_s > 0; });
}

std::map<std::string, double> LinkGate::figures(InstanceId viewer) const {
  const auto found = links_.find(viewer);
  if (found == links_.end()) return {};
  const Link& link = found->second;
  std::map<std::string, double> out{{"backlog_bytes", link.backlog()}};
  if (link.told.rate_bytes_s > 0) out["link_mbit"] = link.told.rate_bytes_s * 8e-6;
  if (link.told.rtt_s > 0) out["rtt_ms"] = link.told.rtt_s * 1e3;
  return out;
}

}  // namespace telesplat::master
