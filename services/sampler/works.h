// Makes the work for a kind of scene. Only works.cpp knows which: it has a row for each kind.
#pragma once

#include <memory>

#include "common/core/result.h"
#include "common/metrics/recorder.h"
#include "common/scene/kind.h"
#include "services/sampler/sampler_options.h"
#include "services/sampler/work.h"

namespace telesplat::sampler {

class Sampler;

/// Parts that works are made with; all of them outlive the works.
struct WorkTools {
  const SamplerOptions& options;
  net::Context& context;
  net::MasterLink& link;
  metrics::SpanRecorder& spans;
  std::unique_ptr<Sampler>& mesh_sampler;  ///< made beforehand, to be moved from; null: made when a mesh comes
};

/// Error: this kind cannot be sampled here (no OpenGL, for instance).
Result<std::unique_ptr<Work>> make_work(scene::Kind kind, const WorkTools& tools);

}  // namespace telesplat::sampler
