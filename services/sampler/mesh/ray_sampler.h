// The ray sampler's own type, for direct rendering, which traces the same scene.
#pragma once

#include "services/sampler/mesh/ray_scene.h"
#include "services/sampler/mesh/sampler.h"

namespace telesplat::sampler {

class RaySampler final : public Sampler {
 public:
  explicit RaySampler(int threads) : scene_(threads) {}

  const char* name() const override { return "ray"; }
  Status add_chunk(ChunkId id, geometry::ChunkBytes chunk) override;
  Status add_chunks(std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks) override {
    return scene_.add(std::move(chunks));
  }
  void remove_chunk(ChunkId id) override { scene_.remove(id); }
  void set_colours(std::shared_ptr<const scene::ColourTable> colours) override {
    colours_ = colours ? std::move(colours) : neutral_colours();
  }
  void set_clip(const geometry::Clip& clip) override { scene_.set_clip(clip); }
  image::DepthImage sample(const geometry::Camera& camera, const geometry::Rect& tile,
                           const image::PixelMask* mask = nullptr) override;

  RayScene& scene() { return scene_; }
  const scene::ColourTable& colours() const { return *colours_; }

 private:
  RayScene scene_;
  std::shared_ptr<const scene::ColourTable> colours_ = neutral_colours();
};

}  // namespace telesplat::sampler
