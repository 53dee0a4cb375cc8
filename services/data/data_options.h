// Options for reading a data set: the options of a data server. The launcher has most of them, too.
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
  MeshOptions mesh;      ///< its placement applies to all kinds of scene
  VolumeOptions volume;  ///< its `raw` and `series` apply to surfaces of volumes, too
  julia::SceneOptions julia;
  std::string companions = "folder";  ///< where a server reads files that a data file names: "folder" or "anywhere"

  /// Returns the options for open_mesh. Without --colour-by, the array that the file marks colours the mesh.
  MeshOptions mesh_options() const;
};

struct DataServiceOptions : DataOptions {
  net::ServiceOptions service;
  bool report_progress = false;  ///< "progress STAGE FRACTION" lines on stdout, for the launcher
};

/// Flags of a data set, which `telesplat run` passes on to its data servers.
options::Table scene_table(DataOptions& options);
/// Flags of a data set that only a data server has: the scene, its part of a volume, memory.
options::Table server_table(DataOptions& options);
/// All flags of a data server.
options::Table table(DataServiceOptions& options);

}  // namespace telesplat::data
