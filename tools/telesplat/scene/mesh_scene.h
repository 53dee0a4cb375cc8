// Triangles: meshes, elevation rasters and isosurfaces of volumes.
#pragma once

#include <map>
#include <optional>

#include "common/scene/colouring.h"
#include "tools/telesplat/scene/epoch_clips.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {

class MeshScene : public Scene {
 public:
  using Scene::Scene;
  scene::Kind kind() const override { return scene::Kind::kMesh; }
  /// Reads epochs.csv (epoch, ..., "colouring") if there is one that tells of colours.
  Status read_record(const std::string& run_directory) override;
  Result<std::unique_ptr<DirectScene>> open_direct(int threads, const data::Progress& progress) const override;
  std::string summary(uint64_t primitives) const override;
  Result<data::Description> describe_data(const data::Progress& progress) const override;

  /// The colours of a run's epochs.
  struct Epochs {
    std::string directory;
    std::map<uint64_t, std::optional<scene::Colouring>> by_id;  ///< nothing: the file's own colours
    EpochClips clips;
    bool told = false;  ///< else the run's record does not tell: all epochs look as the run began
    /// Error: epochs.csv has no such epoch.
    Result<std::optional<scene::Colouring>> at(EpochId epoch) const;
  };

 private:
  Epochs epochs_;
};

}  // namespace telesplat::launcher
