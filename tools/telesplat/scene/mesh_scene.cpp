#include "tools/telesplat/scene/mesh_scene.h"

#include <fmt/format.h>

#include "services/data/inspect.h"
#include "services/data/open_mesh.h"
#include "services/sampler/mesh/sampler.h"

namespace telesplat::launcher {
namespace {

class DirectMesh : public DirectScene {
 public:
  DirectMesh(std::shared_ptr<data::MeshStore> store, int threads)
      : store_(std::move(store)), sampler_(sampler::make_ray_sampler(threads)) {}

  Status load() {
    std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks;
    for (const auto& c : store_->chunks()) chunks.emplace_back(c.id, store_->chunk(c.id));
    return sampler_->add_chunks(std::move(chunks));
  }

  Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading, EpochId) override {
    return sampler::render_directly(*sampler_, camera, image::Shading(shading, camera));
  }
  Result<image::DepthImage> sample(const geometry::Camera& camera, EpochId) override {
    return sampler_->sample(camera, {0, 0, camera.width, camera.height});
  }
  geometry::Box box_room() const override { return store_->info().box_room; }
  uint64_t primitives() const override { return store_->info().triangles; }
  std::string size() const override { return fmt::format("{} triangles", primitives()); }

 private:
  std::shared_ptr<data::MeshStore> store_;
  std::unique_ptr<sampler::Sampler> sampler_;
};

}  // namespace

Result<std::unique_ptr<DirectScene>> MeshScene::open_direct(int threads, const data::Progress& progress) const {
  auto store = data::open_mesh(options_.scene, options_.mesh_options(), progress);
  if (!store) return store.error();
  auto out = std::make_unique<DirectMesh>(std::move(*store), threads);
  if (const Status s = out->load(); !s) return s.error();
  return std::unique_ptr<DirectScene>(std::move(out));
}

std::string MeshScene::summary(uint64_t primitives) const { return fmt::format(": {} triangles", primitives); }

Result<data::Description> MeshScene::describe_data(const data::Progress& progress) const {
  const auto facts = data::inspect_mesh(options_.scene, options_.mesh_options(), progress);
  if (!facts) return facts.error();
  return data::describe(*facts);
}

}  // namespace telesplat::launcher
