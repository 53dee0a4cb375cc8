#include "tools/telesplat/scene/direct_scene.h"

#include <fmt/format.h>

#include "services/sampler/julia/sampler.h"
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

class DirectJulia : public DirectScene {
 public:
  DirectJulia(RecordedJulia julia, int threads) : julia_(std::move(julia)), threads_(threads), sampler_(threads) {}

  Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading,
                           EpochId epoch) override {
    const auto scene = at(epoch);
    if (!scene) return scene.error();
    return sampler::render_julia_directly(*scene, camera, image::Shading(shading, camera), threads_);
  }
  Result<image::DepthImage> sample(const geometry::Camera& camera, EpochId epoch) override {
    const auto scene = at(epoch);
    if (!scene) return scene.error();
    return sampler_.sample(*scene, camera, {0, 0, camera.width, camera.height}, 1);
  }
  geometry::Box box_room() const override { return julia_.placement.box_room; }
  uint64_t primitives() const override { return 0; }
  std::string size() const override { return fmt::format("{} iterations", julia_.begin.iterations); }

 private:
  Result<sampler::JuliaScene> at(EpochId epoch) const {
    const auto parameters = julia_.at(epoch);
    if (!parameters) return parameters.error();
    return sampler::JuliaScene(*parameters, julia_.placement);
  }

  RecordedJulia julia_;
  int threads_;
  sampler::JuliaSampler sampler_;
};

}  // namespace

Result<std::unique_ptr<DirectScene>> open_direct_mesh(const std::string& path, const data::MeshOptions& options,
                                                      int threads,
                                                      const std::function<void(const char*, double)>& progress) {
  auto store = data::MeshStore::open(path, options, progress);
  if (!store) return store.error();
  auto out = std::make_unique<DirectMesh>(std::move(*store), threads);
  if (const Status s = out->load(); !s) return s.error();
  return std::unique_ptr<DirectScene>(std::move(out));
}

std::unique_ptr<DirectScene> open_direct_julia(RecordedJulia julia, int threads) {
  return std::make_unique<DirectJulia>(std::move(julia), threads);
}

}  // namespace telesplat::launcher
