// `telesplat run SCENE`: the whole pipeline on this machine, headless and recorded. `telesplat view SCENE`: the same in a window.
#pragma once

#include "client/viewer/viewer_service.h"
#include "common/julia/flags.h"
#include "services/data/mesh/store.h"
#include "services/data/volume/store.h"
#include "services/master/master_service.h"
#include "tools/telesplat/scene/scene_kind.h"

namespace telesplat::launcher {

/// viewer.window tells `view` from `run`.
struct RunOptions {
  std::string scene;  ///< path of a data file or folder, or "julia"
  SceneKind kind = SceneKind::kNone;
  data::MeshOptions mesh;
  data::VolumeOptions volume;
  std::string series_rate;  ///< --series-rate as given
  julia::SceneOptions julia;
  master::MasterServiceOptions master;
  viewer::ViewerOptions viewer;
  int samplers = 1, data_servers = 1, viewers = 1;
  std::string wall;  ///< "2x1": the viewers are the tiles of a wall; empty: each shows all of the picture
  std::string sampler_kind = "auto";
  int sampler_threads = 0;    ///< a sampler's; 0: the machine's cores shared among the samplers
  std::string join_master;    ///< --master: join a running session instead of starting one
  std::string out;            ///< run folder; empty: run makes one, view records nothing
  std::string log_directory;  ///< of the processes; empty: OUT/logs
  double started_s = 0;       ///< when the command began, on the monotonic clock: start-up times count from there
  uint64_t seed = 0;
  bool record_depth = false;       ///< keep sampled depth images in OUT/depth
  bool background_servers = true;  ///< samplers, packer and data run at lower priority than the viewer
  bool shows_julia() const { return scene == julia::kSceneWord; }
};

/// What `telesplat view` does unless told otherwise: a window, until it is closed, with the camera in the person's hands.
RunOptions view_defaults();

/// Flags of `run`, or of `view` if options.viewer.window is set.
void add_run_flags(CLI::App& app, RunOptions& options);

/// flags: as parsed into `options`. A window that is closed, or Ctrl-C there, is an end like any other. Exit code: 0 done, 1 failed while running, 2 bad usage or input. No process is left behind in any case.
int run(const CLI::App& flags, RunOptions options);

}  // namespace telesplat::launcher
