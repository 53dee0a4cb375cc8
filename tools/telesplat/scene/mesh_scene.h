// Triangles: meshes, elevation rasters and isosurfaces of volumes.
#pragma once

#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {

class MeshScene : public Scene {
 public:
  using Scene::Scene;
  scene::Kind kind() const override { return scene::Kind::kMesh; }
  Result<std::unique_ptr<DirectScene>> open_direct(int threads, const data::Progress& progress) const override;
  std::string summary(uint64_t primitives) const override;
  Result<data::Description> describe_data(const data::Progress& progress) const override;
};

}  // namespace telesplat::launcher
