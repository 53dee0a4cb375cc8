#include "tools/telesplat/bench/steering/options.h"

#include "common/splat/kernel_traits.h"

namespace telesplat::launcher {
namespace {

using options::Range;

options::Table walk_table(SteeringBenchOptions& o) {
  return {
      {.flag = "scenes", .value = &o.scenes, .help = "mesh files, or the word julia; one after the other"},
      {.flag = "--trajectory",
       .value = &o.trajectory,
       .help = "orbit, or CSV files of poses with commas between, walked one after the other, round and round"},
      {.flag = "--duration",
       .value = &o.duration_s,
       .help = "seconds of the walk, which takes as long as it takes; 0: the trajectory's length",
       .limits = Range{0, 3600}},
      {.flag = "--hold",
       .value = &o.hold_s,
       .help = "seconds for which the head then stands still",
       .limits = Range{0, 600}},
      {.flag = "--size", .value = &o.size, .help = "size of the display in pixels, WxH"},
      {.flag = "--fov", .value = &o.fov_deg, .help = "horizontal field of view in degrees", .limits = Range{1, 170}},
      {.flag = "--sampling-size",
       .value = &o.sampling_size,
       .help = "size of views in pixels, WxH, or auto: as viewers choose it"},
      {.flag = "--update-rate",
       .value = &o.views_per_s,
       .help = "views asked for in a second, at most",
       .limits = Range{0.1, 100}},
      {.flag = "--cores",
       .value = &o.cores,
       .help = "cores that share the work of samplers and packer: how long views take; 0: each as long as --latency",
       .limits = Range{0, 1024}},
      {.flag = "--latency",
       .value = &o.latency_s,
       .help = "with --cores 0: seconds until a view is complete",
       .limits = Range{0, 10}},
      {.flag = "--rays-per-s",
       .value = &o.rays_per_s,
       .help = "with --cores 0: rays of extra frames cast in a second",
       .limits = Range{1, 1e12}},
  };
}

options::Table steering_table(SteeringBenchOptions& o) {
  return {
      {.flag = "--modes",
       .value = &o.modes,
       .help = "what walks side by side, with commas between: off, on, no-cell (on, without a view cell)"},
      {.flag = "--view-cell",
       .value = &o.view_cell_m,
       .help = "metres that a head may move without finding holes; 0: no view cell",
       .limits = Range{0, 10}},
      {.flag = "--validation",
       .value = &o.validation,
       .help = "each good pixel is checked once in so many views; 0: never",
       .limits = Range{0, 4096}},
      {.flag = "--still-rays",
       .value = &o.still_rays,
       .help = "rays for a pixel of a still view: 1, 4 or 16",
       .limits = Range{1, 16}},
  };
}

options::Table report_table(SteeringBenchOptions& o) {
  return {
      {.flag = "--compare-every",
       .value = &o.compare_every_s,
       .help = "seconds of the walk between views that are compared with direct rendering",
       .limits = Range{0.01, 1000}},
      {.flag = "--reference-samples",
       .value = &o.reference_samples,
       .help = "rays for a pixel of the reference: 1, 4, 9 or 16; views are compared with one ray, too",
       .limits = Range{1, 16}},
      {.flag = "--splat", .value = &o.splat, .help = "kernel", .limits = splat::kernel_names()},
      {.flag = "--audit",
       .value = &o.audit,
       .help = "sample each view whole beside its plan, and count the rays that the plan misses or casts in vain"},
      {.flag = "--pictures",
       .value = &o.pictures,
       .help = "plan pictures along the walk; needs --out",
       .limits = Range{0, 1000}},
      {.flag = "--threads",
       .value = &o.threads,
       .help = "threads to plan, sample and draw with; 0: one a core",
       .limits = Range{0, 1024}},
      {.flag = "--out", .value = &o.out, .help = "folder for tables and pictures"},
  };
}

}  // namespace

options::Table table(SteeringBenchOptions& o) {
  return joined(joined(joined(walk_table(o), steering_table(o)), report_table(o)), data::scene_table(o.data));
}

}  // namespace telesplat::launcher
