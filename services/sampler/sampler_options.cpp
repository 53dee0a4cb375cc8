#include "services/sampler/sampler_options.h"

namespace telesplat::sampler {

options::Table table(SamplerOptions& o) {
  using options::Range;
  return options::joined(net::service_table(o.service, net::Ends::kConnects),
                         {{.flag = "--sampler",
                           .value = &o.kind,
                           .help = "of meshes: ray (Embree), raster (OpenGL), or auto: raster on a GPU, else ray",
                           .limits = options::Names{"auto", "ray", "raster"},
                           .fits = scene::Kinds::of(scene::Pipeline::kPoints)},
                          {.flag = "--threads",
                           .value = &o.threads,
                           .help = "threads to sample with; 0: one a core",
                           .limits = Range{0, 1024}},
                          {.flag = "--chunk-cache-mb",
                           .value = &o.chunk_cache_mb,
                           .help = "memory for chunks, MB",
                           .limits = Range{1, 1e6}}});
}

}  // namespace telesplat::sampler
