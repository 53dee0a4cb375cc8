// What sampling costs whom: learnt from finished tiles, used to size leases.
#pragma once

#include <map>
#include <string>

namespace telesplat::master {

class SamplingCosts {
 public:
  /// `sampler` takes leases.
  void join(const std::string& sampler);
  void leave(const std::string& sampler);
  size_t samplers() const { return samplers_.size(); }

  /// A tile of `pixels` pixels took `sampler` so long. Ignored: samplers that left, times that are not above 0.
  void learn(const std::string& sampler, double seconds, double pixels);
  /// Seconds a pixel: mean of the sampler's last ten tiles or so, weighted by pixels; while it has none that of all; 0
  /// if nothing is known.
  double pixel_s(const std::string& sampler) const;
  /// The sampler has finished tiles.
  bool knows(const std::string& sampler) const;

 private:
  struct Mean {
    double seconds = 0, pixels = 0;
    void add(double s, double n);
  };
  std::map<std::string, Mean> samplers_;
  Mean all_;
};

}  // namespace telesplat::master
