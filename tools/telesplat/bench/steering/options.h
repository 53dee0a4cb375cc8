// What `telesplat bench steering` is told.
#pragma once

#include <string>
#include <vector>

#include "common/options/table.h"
#include "services/data/data_options.h"

namespace telesplat::launcher {

struct SteeringBenchOptions {
  data::DataOptions data;            ///< how the scenes are read; its own scene is none
  std::vector<std::string> scenes;   ///< meshes or their like, or the word for Julia sets
  std::string trajectory = "orbit";  ///< or CSV files with commas between
  double duration_s = 0;             ///< of the walk; 0: the trajectory's length
  double hold_s = 5;                 ///< the head stands still at the end
  double views_per_s = 12;           ///< at most
  double cores = 1;                  ///< that share the work of samplers and packer; 0: each view takes latency_s
  double latency_s = 0.05;
  double rays_per_s = 4e6;  ///< if there are no cores: how long extra frames take
  double compare_every_s = 1;
  int reference_samples = 16;  ///< of a pixel, in the reference
  std::string size = "1280x800", sampling_size = "auto";
  double fov_deg = 90;
  double view_cell_m = 0.2;
  int validation = 32;
  int still_rays = 16;
  std::string modes = "off,on,no-cell";
  std::string splat = "disc";
  bool audit = false;  ///< count the rays that a plan misses or casts in vain
  int pictures = 0;    ///< plan pictures along the walk
  int threads = 0;
  std::string out;  ///< folder for tables and pictures; empty: none
};

options::Table table(SteeringBenchOptions& options);

}  // namespace telesplat::launcher
