// A packer with its planner, and a sampler of meshes that casts the planned rays: the real ones, without sockets.
#pragma once

#include <gtest/gtest.h>

#include "common/codec/mask_stream.h"
#include "services/packer/points/packer_core.h"
#include "services/packer/points/plan/planner.h"
#include "services/sampler/mesh/sampler.h"

namespace telesplat::test {

class SteeredSession {
 public:
  static constexpr EpochId kEpoch{1};
  static constexpr double kUpdate_s = 0.1;

  /// steering: false: every view is sampled whole.
  explicit SteeredSession(const geometry::Box& box, bool steering = true)
      : steering_(steering), model_{box, 5, true}, core_(config(), kEpoch), planner_(plans()) {
    core_.watch(steering ? &planner_ : nullptr);
  }
  sampler::Sampler& sampler() { return *sampler_; }
  const packer::PackerCore& core() const { return core_; }
  /// Clusters forgotten so far.
  size_t forgotten() const { return forgotten_; }

  /// Samples a view, kUpdate_s after the one before. Returns the number of rays.
  uint64_t update(const geometry::Camera& camera) {
    now_s_ += kUpdate_s;
    request_ = {
        .frame = {++frame_}, .epoch = kEpoch, .viewer = {7}, .request = {frame_}, .camera = camera, .tile_size = 256};
    const wire::Plan plan =
        steering_ ? planner_.plan(core_.model(), core_.sequence(), request_, now_s_) : wire::Plan{.full = true};
    if (!plan.full) return cast_tiles(plan);
    cast(camera, {0, 0, camera.width, camera.height}, nullptr, 0, 1);
    return uint64_t(camera.width) * uint64_t(camera.height);
  }
  /// Samples frames of extra rays for the newest view: `most`, or until a plan is empty. Returns the number of rays.
  uint64_t extra(int most) {
    uint64_t rays = 0;
    request_.extra = true;
    for (int i = 0; i < most && steering_; ++i) {
      request_.frame = {++frame_};
      ++request_.round;
      const wire::Plan plan = planner_.plan(core_.model(), core_.sequence(), request_, now_s_);
      if (plan.tiles.empty()) break;
      rays += cast_tiles(plan);
    }
    return rays;
  }

 private:
  packer::Config config() const {
    packer::Config out;
    out.model = model_, out.threads = 2;
    return out;
  }
  packer::PlanConfig plans() const {
    packer::PlanConfig out;
    out.model = model_, out.threads = 2;
    return out;
  }

  uint64_t cast_tiles(const wire::Plan& plan) {
    uint64_t rays = 0;
    size_t word = 0;
    const size_t count = plan.tiles.size() / wire::kPlanNumbers;
    for (size_t i = 0; i < count; ++i) {
      const uint32_t* n = &plan.tiles[i * wire::kPlanNumbers];
      const geometry::Rect rect{int(n[0]), int(n[1]), int(n[2]), int(n[3])};
      image::PixelMask mask(rect.width, rect.height);
      if (n[5] > 0) {
        auto decoded = codec::decode_mask(std::span(plan.masks).subspan(word, n[5]), rect.width, rect.height);
        EXPECT_TRUE(decoded.ok());
        if (decoded) mask = std::move(*decoded);
      }
      cast(plan.camera, rect, n[5] > 0 ? &mask : nullptr, uint32_t(i), uint32_t(count));
      word += n[5], rays += n[4];
    }
    return rays;
  }

  void cast(const geometry::Camera& camera, const geometry::Rect& rect, const image::PixelMask* mask, uint32_t number,
            uint32_t count) {
    packer::SampledTile tile;
    tile.frame = {frame_}, tile.epoch = kEpoch, tile.viewer = {7}, tile.request = request_.request;
    tile.camera = camera, tile.rect = rect, tile.tile = number, tile.tiles_in_frame = count;
    tile.extra = request_.extra;
    tile.image = sampler_->sample(camera, rect, mask);
    if (steering_) planner_.take(tile, mask == nullptr, now_s_);
    EXPECT_TRUE(core_.submit(std::move(tile), now_s_).ok());
    if (!steering_) return;
    planner_.settle();
    const auto keys = planner_.disproved();
    forgotten_ += keys.size();
    core_.forget(keys);
  }

  const bool steering_;
  points::ModelConfig model_;
  packer::PackerCore core_;
  packer::Planner planner_;
  std::unique_ptr<sampler::Sampler> sampler_ = sampler::make_ray_sampler(2);
  wire::PlanRequest request_;  // the newest
  uint64_t frame_ = 0;
  size_t forgotten_ = 0;
  double now_s_ = 10;
};

}  // namespace telesplat::test
