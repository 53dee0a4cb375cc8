// A data server's volume: read, placed in the room, classified and cut into slices on demand. Several servers may hold
// different parts of one volume.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/geometry/clip.h"
#include "common/scene/placement.h"
#include "common/scene/probe.h"
#include "common/volume/histogram.h"
#include "common/volume/session.h"
#include "common/volume/voxels.h"
#include "services/data/base/placement_options.h"
#include "services/data/volume/volume.h"

namespace telesplat::data {

/// Reads one step of a volume.
using StepReader = std::function<Result<Volume>(size_t step, const ReadProgress&)>;

/// Used from one thread at a time.
class VolumeStore {
 public:
  /// Opens a volume; up "auto" means z. Reads the first step; all of them if they fit in cache_mb, so that levels cover
  /// all values. Otherwise levels cover the values of the first step, and values of later steps are clamped to
  /// them. Steps that are read later, and the next step ahead, are read in a thread of their own. Errors name the file.
  static Result<std::unique_ptr<VolumeStore>> open(const std::string& path, const VolumeOptions& options,
                                                   const PlacementOptions& placement, const Progress& progress);
  /// The same for volumes from any source. name: for errors.
  static Result<std::unique_ptr<VolumeStore>> make(StepReader read, size_t steps, const std::string& name,
                                                   const VolumeOptions& options, const PlacementOptions& placement,
                                                   const Progress& progress);
  virtual ~VolumeStore() = default;

  /// The session as it begins; part and parts are this store's. Valid: read_session takes it.
  virtual const volume::Session& session() const = 0;
  /// Histogram of the values of all slices of the first step.
  virtual const volume::Histogram& histogram() const = 0;
  virtual std::string format() const = 0;
  virtual std::string remark() const = 0;  ///< Volume::remark of the first step
  /// Placement of the file's own coordinates.
  virtual const scene::Placement& placement() const = 0;
  /// Returns the hash of all steps that were read when it was opened, the same for all parts: it identifies the data.
  virtual uint64_t content_hash() const = 0;

  /// Returns the voxels of slices [k_begin, k_end) of a step whose level is in `shown` and not in `have`; with normals
  /// if the session is lit. Slices outside this part are left out: the answer's own k_begin and k_end name its slices.
  /// Error: a step cannot be read.
  virtual Result<volume::Voxels> voxels(int step, int k_begin, int k_end, const volume::LevelSet& shown,
                                        const volume::LevelSet& have) = 0;
  /// Finds the place where a ray meets enough of a step, by its voxels: cast.h. Error: as there, and as voxels().
  virtual Result<scene::Probed> cast(int step, const volume::TransferFunction& transfer, const geometry::Clip& clip,
                                     const scene::Probe& probe) = 0;
  /// Counts the visible voxels of every slice of this part, for a set of levels. Error: as voxels().
  virtual Result<std::vector<uint32_t>> slice_weights(int step, const volume::LevelSet& shown) = 0;
};

/// Returns the axis of a volume that points up: z, unless the options say otherwise.
std::string up_of_volume(const PlacementOptions& options);

/// Returns the levels that a transfer function does not make transparent.
volume::LevelSet shown_levels(const volume::TransferFunction& transfer, const volume::Levels& levels);

}  // namespace telesplat::data
