#include "services/master/tiles/pacing.h"

#include <algorithm>

namespace telesplat::master {

void LinkGate::report(const wire::LinkReport& told, double now_s) {
  auto [found, is_new] = links_.try_emplace(told.viewer);
  Link& link = found->second;
  if (is_new) link.wished_s = now_s;
  link.told = told;
  link.told_s = now_s;
  link.since_bytes = 0;  // the packer reports in the order in which it publishes
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

// Older tiles fade: rows of the frame's middle cost more than those of its edges, so a mean of ten tiles is better
// than one of a hundred.
void SamplingCosts::Mean::add(double s, double n) {
  seconds = 0.9 * seconds + s;
  pixels = 0.9 * pixels + n;
}

void SamplingCosts::join(const std::string& sampler) { samplers_.try_emplace(sampler); }
void SamplingCosts::leave(const std::string& sampler) { samplers_.erase(sampler); }

void SamplingCosts::learn(const std::string& sampler, double seconds, double pixels) {
  const auto found = samplers_.find(sampler);
  if (found == samplers_.end() || !(seconds > 0) || !(pixels > 0)) return;
  found->second.add(seconds, pixels);
  all_.add(seconds, pixels);
}

bool SamplingCosts::knows(const std::string& sampler) const {
  const auto found = samplers_.find(sampler);
  return found != samplers_.end() && found->second.pixels > 0;
}

double SamplingCosts::pixel_s(const std::string& sampler) const {
  const auto found = samplers_.find(sampler);
  const Mean& mean = found != samplers_.end() && found->second.pixels > 0 ? found->second : all_;
  return mean.pixels > 0 ? mean.seconds / mean.pixels : 0;
}

uint64_t RefiningRays::most(size_t samplers) const {
  return uint64_t(std::clamp(each_ * double(samplers), kLeast, kMost));
}

void RefiningRays::learn(double took_s, double refining, double put_off, size_t samplers) {
  if (took_s > 1.5 * kTarget_s && 2 * refining > double(most(samplers)))
    each_ *= 0.7;
  else if (took_s < kTarget_s && put_off > 0)
    each_ *= 1.25;
  each_ = std::clamp(each_, kLeast / double(samplers), kMost);
}

void Trust::delivered(const std::string& sampler, double now_s) {
  State& s = samplers_[sampler];
  trusted_ += !s.trusted;
  s.trusted = true;
  delivered_s_ = now_s;
}

void Trust::failed(const std::string& sampler, double now_s) {
  const auto [s, is_new] = samplers_.try_emplace(sampler);
  if (!is_new && !s->second.trusted) return;
  trusted_ -= s->second.trusted;
  s->second.trusted = false, s->second.since_s = now_s;
}

void Trust::leave(const std::string& sampler) {
  const auto s = samplers_.find(sampler);
  if (s == samplers_.end()) return;
  trusted_ -= s->second.trusted, stuck_ -= s->second.told;
  samplers_.erase(s);
}

bool Trust::has(const std::string& sampler) const {
  const auto s = samplers_.find(sampler);
  return s != samplers_.end() && s->second.trusted;
}

bool Trust::has_failed(const std::string& sampler) const {
  const auto s = samplers_.find(sampler);
  return s != samplers_.end() && !s->second.trusted;
}

std::optional<double> Trust::stuck_s(const std::string& sampler, double now_s) const {
  const auto s = samplers_.find(sampler);
  if (s == samplers_.end() || s->second.trusted || !s->second.told) return std::nullopt;
  return now_s - s->second.since_s;
}

std::vector<Trust::News> Trust::news(double now_s, const std::function<bool(const std::string&)>& holds_work) {
  std::vector<News> out;
  for (auto& [name, s] : samplers_) {
    const bool stuck = !s.trusted && (s.told || (now_s - s.since_s > kTold_s && holds_work(name)));
    if (stuck == s.told) continue;
    s.told = stuck;
    stuck ? ++stuck_ : --stuck_;
    out.push_back({name, !stuck});
  }
  return out;
}

}  // namespace telesplat::master
