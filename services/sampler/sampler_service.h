// The sampler process (T5.2.2): takes leases, samples what they ask for, encodes, pushes. The way of sampling depends
// on the session's kind of scene (works.h).
#pragma once

#include <memory>

#include "common/net/turns.h"
#include "services/sampler/sampler_options.h"

namespace telesplat::sampler {

class Sampler;

class SamplerService : public net::Turns {
 public:
  /// mesh_sampler: samples meshes; null: one is made when a mesh comes. Context and options must outlive it.
  static std::unique_ptr<SamplerService> open(net::Context& context, const SamplerOptions& options,
                                              std::unique_ptr<Sampler> mesh_sampler);
  virtual int exit_code() const = 0;
};

/// Serves until a signal or the master's Shutdown. After SIGINT or SIGTERM it finishes the leases that it holds, asks
/// for no more, and ends within 2 s; after a Shutdown it ends at once. Exit code: 0; 1 if the sampler asked for cannot
/// be made.
Result<int> run(const SamplerOptions& options);

}  // namespace telesplat::sampler
