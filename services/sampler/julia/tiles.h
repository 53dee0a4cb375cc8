// Tiles of a Julia set. The master's welcomes describe the whole scene.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "services/sampler/epoch_book.h"
#include "services/sampler/julia/sampler.h"
#include "services/sampler/tiles/tile_source.h"

namespace telesplat::sampler {

class JuliaTiles final : public TileSource {
 public:
  explicit JuliaTiles(int threads) : sampler_(threads) {}

  const char* name() const override { return "julia"; }
  /// Remembers the epoch's parameters. Logs bad ones once; that epoch's leases are hopeless.
  void on_welcome(const wire::Welcome& session) override;
  bool takes_leases() const override { return !epochs_.empty(); }
  Readiness readiness(const HeldLease& lease, double now_s) override;
  Sampled sample(const HeldLease& lease) override;

 private:
  struct Epoch {
    std::map<std::string, double> parameters;
    geometry::Box box_room;
    std::string clip;                 // the fact "clip"
    std::optional<JuliaScene> scene;  // nullopt: the parameters are bad
  };
  JuliaSampler sampler_;
  EpochBook<Epoch> epochs_;
};

}  // namespace telesplat::sampler
