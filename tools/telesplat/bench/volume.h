// `telesplat bench volume`: how fast views of a volume are constructed with 1 to 4 samplers and 1 to 4 viewers of a display wall, as tables
// 7.3 and 7.4 of the thesis have it. Once with all processes computing, on the processors that are here; once with a processor for each, by
// waiting for what was measured.
#pragma once

#include <string>
#include <vector>

#include "services/data/volume/store.h"

namespace CLI {
class App;
}

namespace telesplat::launcher {

struct VolumeBenchOptions {
  std::string volume;  ///< path; empty: a made-up scan of generated_side^3 voxels
  int generated_side = 256;
  data::VolumeOptions data;
  std::vector<int> samplers{1, 2, 3, 4}, viewers{1, 2, 3, 4};
  std::string size = "1600x1200";  ///< pixels of the wall, shared by its viewers
  double fov_deg = 60;
  int buffers = 3;
  double seconds = 4;  ///< measured of each combination
  std::string out = "volume-bench";
  bool computed = true, simulated = true;
};

void add_volume_bench_flags(CLI::App& app, VolumeBenchOptions& options);

/// Prints tables; leaves volume.csv, volume.md and the runs' records in options.out. Exit code: 0; 1 something failed or was interrupted; 2 bad
/// usage or input. No process is left behind in any case.
int bench_volume(const VolumeBenchOptions& options);

}  // namespace telesplat::launcher
