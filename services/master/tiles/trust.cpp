#include "services/master/tiles/trust.h"

namespace telesplat::master {

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
