// `telesplat bench cache`: what a point model costs after minutes of walking, without waiting for real time. Each view of a walk is sampled by rays,
// packed, coded, decoded and inserted by the code that packer and viewer run, one view after the other in this process.
#pragma once

#include <string>

#include "services/data/mesh/store.h"

namespace CLI {
class App;
}

namespace telesplat::launcher {

struct CacheBenchOptions {
  std::string path;                  ///< a mesh, or with mesh.iso a volume
  std::string trajectory = "orbit";  ///< or CSV files with commas between, walked one after the other, round and round
  double minutes = 5;                ///< of the walk
  double views_per_s = 4;            ///< sampled, of the walk's seconds
  double latency_s = 0.2;            ///< the display is as far ahead of the views
  std::string size = "1280x800";     ///< of the display
  std::string sampling_size;         ///< empty: the display's
  double fov_deg = 90;
  int octree_depth = 0;  ///< 0: as the master chooses for meshes
  bool grid = false;     ///< measure the other design too (bench_surfel_grid.h)
  int threads = 0;       ///< to sample and to draw with; 0: all cores
  std::string splat = "disc";
  double splat_scale = 0;    ///< 0: what suits the kernel
  double nearest = -1;       ///< packer::Config::nearest_sample; below 0: as sessions have it
  std::string out;  ///< folder for cache.csv and pictures; empty: none
  data::MeshOptions mesh;
};

void add_cache_bench_flags(CLI::App& app, CacheBenchOptions& options);

/// Prints a table, a line a minute. Exit code: 0 done, 1 failed or interrupted, 2 bad usage or input.
int bench_cache(const CacheBenchOptions& options);

}  // namespace telesplat::launcher
