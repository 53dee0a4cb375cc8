// Triangles: meshes, elevation rasters and isosurfaces of volumes.
#pragma once

#include <optional>

#include "common/scene/colouring.h"
#include "tools/telesplat/scene/epochs.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {

class MeshScene : public Scene {
 public:
  using Scene::Scene;
  scene::Kind kind() const override { return scene::Kind::kMesh; }
  /// Reads epochs.csv (epoch, ..., "colouring") if it has colours.
  Status read_record(const std::string& run_directory) override;
  Result<std::unique_ptr<DirectScene>> open_direct(int threads, const data::Progress& progress) const override;
  std::string summary(uint64_t primitives) const override;
  Result<data::Description> describe_data(const data::Progress& progress) const override;

  /// Nothing: the file's own colours. If a record has no colours, all epochs look as the run began.
  using Colours = Epochs<std::optional<scene::Colouring>>;

 private:
  Colours epochs_;
};

}  // namespace telesplat::launcher
