// `telesplat bench scaling`: how a Julia set's frame speeds up with the number of samplers (T7.3, table 7.2), with real processes, leases
// and messages. Where samplers outnumber the processors, the computing of each row is replaced by a wait of its measured cost.
#pragma once

#include <string>
#include <vector>

#include "common/julia/flags.h"

namespace CLI {
class App;
}

namespace telesplat::launcher {

struct ScalingOptions {
  std::vector<int> nodes{1, 2, 4, 8, 16, 32, 40};
  std::string size = "1024x640";
  julia::SceneOptions scene;
  std::string row_cost = "both";  ///< "thesis", "cheap" (20 times cheaper), "both", "measured", or seconds a frame
  int frames = 0;                 ///< measured for each number of nodes, the median counts; 0: as many as seem worth it
  std::string out = "scaling";
  bool kill = true, computed = true;
};

void add_scaling_flags(CLI::App& app, ScalingOptions& options);

/// Prints tables; leaves scaling.csv, scaling.json, scaling.png and the runs' records in options.out. Exit code: 0; 1 something failed
/// or was interrupted; 2 bad usage. No process is left behind in any case.
int bench_scaling(const ScalingOptions& options);

}  // namespace telesplat::launcher
