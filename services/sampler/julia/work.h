// Leases of a Julia set: all there is to know of the scene comes with the master's welcomes.
#pragma once

#include <map>
#include <optional>

#include "services/sampler/julia/sampler.h"
#include "services/sampler/tiles/tile_source.h"

namespace telesplat::sampler {

class JuliaWork final : public LeaseWork {
 public:
  static constexpr size_t kEpochs = 8;          ///< whose parameters are remembered, the newest ones
  static constexpr double kUnknownEpoch_s = 1;  ///< a lease waits so long for its epoch's welcome

  explicit JuliaWork(int threads) : sampler_(threads) {}

  const char* name() const override { return "julia"; }
  /// Remembers the epoch's parameters. Bad ones are told once, and that epoch's leases are hopeless.
  void on_welcome(const wire::Welcome& session) override;
  bool takes_leases() const override { return !epochs_.empty(); }
  Readiness readiness(const HeldLease& lease, double now_s) override;
  Sampled sample(const HeldLease& lease) override;

 private:
  struct Epoch {
    std::map<std::string, double> parameters;
    geometry::Box box_room;
    std::optional<JuliaScene> scene;  // none: the parameters are bad
  };
  JuliaSampler sampler_;
  InstanceId master_;  // of another one the same number is another epoch
  std::map<EpochId, Epoch> epochs_;
};

}  // namespace telesplat::sampler
