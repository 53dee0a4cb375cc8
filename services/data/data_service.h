// The data server process (T5.2.1): opens the data set, says hello, serves chunks to whoever asks.
#pragma once

#include "common/julia/flags.h"
#include "common/net/service.h"
#include "services/data/mesh/store.h"
#include "services/data/volume/flags.h"

namespace telesplat::data {

struct DataServiceOptions {
  net::ServiceOptions service;
  std::string scene;  ///< path of a mesh, raster or volume, or "julia"
  MeshOptions mesh;   ///< of a Julia set: its room size; of a volume: that and which way is up
  VolumeFlags volume;
  julia::SceneOptions julia;
  bool report_progress = false;  ///< "progress STAGE FRACTION" lines on stdout, for the launcher
};

void add_flags(CLI::App& app, DataServiceOptions& options);

/// Serves until told to stop. Exit code: 0, or 2 if the data cannot be read (one line on stderr says why).
int run(const DataServiceOptions& options);

}  // namespace telesplat::data
