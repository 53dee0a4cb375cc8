// `telesplat run SCENE`: the whole pipeline on this machine, recorded.
#pragma once

#include "client/viewer/viewer_service.h"
#include "services/data/mesh_store.h"
#include "services/master/master_service.h"

namespace telesplat::launcher {

struct RunOptions {
  std::string scene;
  data::MeshOptions mesh;
  master::MasterServiceOptions master;
  viewer::ViewerOptions viewer;
  int samplers = 1;
  std::string sampler_kind = "auto";
  int sampler_threads = 0;  ///< a sampler's; 0: the machine's cores shared among the samplers
  std::string join_master;  ///< --master: join a running session instead of starting one
  std::string out;
  double started_s = 0;  ///< when the command began, on the monotonic clock: start-up times count from there
  uint64_t seed = 0;
  bool record_depth = false;       ///< keep sampled depth images in OUT/depth
  bool background_servers = true;  ///< samplers, packer and data run at lower priority than the viewer
};

void add_run_flags(CLI::App& app, RunOptions& options);

/// Exit code: 0 done, 1 failed while running, 2 bad usage or input. No process is left behind in any case.
int run(const RunOptions& options);

}  // namespace telesplat::launcher
