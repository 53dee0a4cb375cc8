// The volume of a run folder: which transfer function and which time step each of its epochs showed.
#pragma once

#include <map>
#include <string>

#include "common/core/ids.h"
#include "services/data/volume/store.h"

namespace telesplat::launcher {

struct RecordedVolume {
  struct Epoch {
    std::string transfer;  ///< text form, absolute values; empty: as the data server begins
    int step = 0;
  };
  std::string directory, file;
  data::VolumeOptions options;  ///< as the run was given them
  data::MeshOptions mesh;
  std::map<uint64_t, Epoch> epochs;  ///< by EpochId; of a run without epochs.csv none: it showed one

  /// Error: epochs.csv has no such epoch.
  Result<Epoch> at(EpochId epoch) const;
};

/// Reads [scene] of session.toml, and epochs.csv (epoch, ..., volume.step, "transfer"). Errors name file, line, value and limit.
/// Precondition: the folder's session.toml says kind = "volume".
Result<RecordedVolume> read_recorded_volume(const std::string& directory);

}  // namespace telesplat::launcher
