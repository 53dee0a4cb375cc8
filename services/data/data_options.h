// What a data set is read with: the options of a data server, most of which the launcher has, too.
#pragma once

#include <string>

#include "common/julia/flags.h"
#include "common/net/service.h"
#include "common/options/table.h"
#include "services/data/mesh/store.h"
#include "services/data/volume/volume.h"

namespace telesplat::data {

struct DataOptions {
  std::string scene;     ///< path of a mesh, raster or volume, or the word "julia"
  MeshOptions mesh;      ///< its placement counts for all kinds of scene
  VolumeOptions volume;  ///< its `raw` and `series` count for surfaces of volumes, too
  julia::SceneOptions julia;
  std::string companions = "folder";  ///< where a data server reads files that others name: "folder" or "anywhere"

  /// What open_mesh takes. Where nobody says what a mesh is coloured by, it is what its file marks (active_array_of()).
  MeshOptions mesh_options() const;
};

struct DataServiceOptions : DataOptions {
  net::ServiceOptions service;
  bool report_progress = false;  ///< "progress STAGE FRACTION" lines on stdout, for the launcher
};

/// Flags of a data set, which `telesplat run` hands on to its data servers.
options::Table scene_table(DataOptions& options);
/// What only a data server takes of a data set: the scene, its part of a volume, memory.
options::Table server_table(DataOptions& options);
/// All that a data server takes.
options::Table table(DataServiceOptions& options);

}  // namespace telesplat::data
