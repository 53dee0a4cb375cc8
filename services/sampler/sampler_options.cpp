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
                          {.flag = "--sampler-memory",
                           .value = &o.memory_mb,
                           .help = "memory for chunks or voxels, MB; 0: a quarter of the machine's or container's",
                           .limits = Range{0, 1e7}}});
}

}  // namespace telesplat::sampler
