#include "services/master/tiles/sampling_costs.h"

namespace telesplat::master {

// Older tiles fade: rows of the frame's middle cost more than those of its edges, so ten tiles tell more than a
// hundred.
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

}  // namespace telesplat::master
