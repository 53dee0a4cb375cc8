// Frames for the packer's tests, cut into tiles, and a replica that follows the packer's events.
#pragma once

#include "common/codec/depth_codec.h"
#include "common/refinement/bounded_patches.h"
#include "services/packer/points/packer_core.h"
#include "tests/support/points_scenes.h"

namespace telesplat::test {

inline constexpr EpochId kEpoch{3};

inline packer::Config packer_config() {
  packer::Config config;
  config.model = scene_config();
  return config;
}

/// Samples the tiles of one frame, `side` pixels a side (the last ones smaller).
inline std::vector<packer::SampledTile> sampled_frame(FrameId id, const geometry::Camera& camera, int side,
                                                      EpochId epoch = kEpoch) {
  std::vector<packer::SampledTile> tiles;
  for (int y = 0; y < camera.height; y += side) {
    for (int x = 0; x < camera.width; x += side) {
      packer::SampledTile t;
      t.frame = id, t.epoch = epoch, t.camera = camera;
      t.tile = static_cast<uint32_t>(tiles.size());
      t.rect = {x, y, std::min(side, camera.width - x), std::min(side, camera.height - y)};
      t.viewer = {77}, t.request = {id.value + 1000};
      t.image = sample_scene(camera, t.rect);
      tiles.push_back(std::move(t));
    }
  }
  for (auto& t : tiles) t.tiles_in_frame = static_cast<uint32_t>(tiles.size());
  return tiles;
}

/// Applies events as a viewer does.
class Replica {
 public:
  explicit Replica(const points::ModelConfig& config) : model_(config) {}

  void apply(const packer::Event& event) {
    if (!event.is_told()) return;
    CHECK(applied_ < event.sequence);
    applied_ = event.sequence;
    if (event.kind == packer::Event::Kind::kEpoch) model_.clear(), bounded_.clear();
    if (event.kind == packer::Event::Kind::kRefine) {
      const auto refinement = bounded_.refine(model_.config(), event.sequence, event.refines, *event.blob);
      CHECK(refinement.ok());
      if (*refinement) model_.commit(points::plan_refinement(model_, **refinement));
    }
    if (event.kind == packer::Event::Kind::kForget) {
      if (event.frames.empty())
        model_.forget(event.clusters);
      else
        model_.forget(event.clusters, event.frames);
    }
    if (event.kind == packer::Event::Kind::kPatch) {
      const auto image = codec::decode(*event.blob, event.rect.width, event.rect.height);
      CHECK(image.ok());
      if (event.refinable) bounded_.add(event.sequence, event.camera, event.rect, *event.blob, event.tag());
      model_.insert(
          points::prepare_patch(model_.config(), event.sequence, event.camera, event.rect, *image, event.tag()));
    }
  }
  /// Applies the events that it missed.
  void catch_up(const packer::PackerCore& core) {
    for (const packer::Event& event : core.events_since(applied_)) apply(event);
    applied_ = core.sequence();
  }
  /// Skips events up to `sequence`, which change nothing here.
  void skip_to(Sequence sequence) { applied_ = std::max(applied_, sequence); }
  Sequence applied() const { return applied_; }
  const points::PointModel& model() const { return model_; }

 private:
  points::PointModel model_;
  refinement::BoundedPatches bounded_;
  Sequence applied_;
};

}  // namespace telesplat::test
