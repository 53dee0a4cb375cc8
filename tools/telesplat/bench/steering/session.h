// One session of `telesplat bench steering`: a packer with its planner, samplers and a viewer's cache, without sockets
// and clocks. Views are sampled, packed, coded, decoded and inserted by the code that the processes run.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "client/viewer/points/model_cache.h"
#include "client/viewer/render/fine_rays.h"
#include "client/viewer/render/renderer.h"
#include "services/packer/points/packer_core.h"
#include "services/packer/points/plan/planner.h"
#include "tools/telesplat/bench/steering/report.h"
#include "tools/telesplat/scene/direct_scene.h"

namespace telesplat::launcher {

struct SteeredSessionConfig {
  std::string name;      ///< of its mode
  bool steering = true;  ///< false: every ray of every view is cast
  packer::PlanConfig plan;
  splat::RenderOptions render;
};

class SteeredSession {
 public:
  static constexpr EpochId kEpoch{1};
  static constexpr InstanceId kViewer{1};
  static constexpr double kExtra_s = 0.05;  ///< that an extra frame takes of the samplers' time, about

  /// Keeps a reference to the scene.
  SteeredSession(const SteeredSessionConfig& config, DirectScene& scene);

  /// A view's own frame. t_s: any steady clock. footprint: ViewRequest::footprint. whole: the view with every ray cast,
  /// to count what the plan misses; or null.
  Result<ViewCost> view(double t_s, const geometry::Camera& camera, double footprint, const image::DepthImage* whole);
  /// The next extra frame of the newest view.
  Result<ViewCost> extra(double t_s, uint64_t most_rays);
  /// A step of what the packer learns when there is time: milliseconds of processor time; 0: nothing is left to do.
  double settle();
  /// Nothing more is to be cast for the newest view.
  bool exhausted() const { return exhausted_; }
  /// By a core, so far.
  double rays_per_cpu_s() const { return sampling_s_ > 0 ? rays_ / sampling_s_ : 0; }
  /// The rays of the newest view's own frame.
  const image::PixelMask& cast() const { return cast_; }
  /// If the newest view was given whole: the pixels that the model lacked, had every ray been cast.
  const image::PixelMask& needed() const { return needed_; }

  /// What the viewer displays at `camera`. refined: the head has stood still for long enough.
  const image::View& draw(const geometry::Camera& camera, bool refined);

  bool steering() const { return config_.steering; }
  const std::string& name() const { return config_.name; }
  const packer::PackerCore& packer() const { return packer_; }

 private:
  wire::Plan plan(double now_s, ViewCost& cost);
  Status sample_frame(const wire::Plan& plan, double now_s, ViewCost& cost);
  void finish(ViewCost& cost);
  void note_cast(const geometry::Rect& rect, const image::PixelMask* mask);
  Status sample_tile(packer::SampledTile tile, const image::PixelMask* mask, double now_s, ViewCost& cost);
  Status insert(const packer::Event& event, ViewCost& cost);
  void forget();
  void find_needed(const geometry::Camera& camera, const image::DepthImage& whole);
  void refine(const geometry::Camera& camera, const splat::SelectionOptions& selection, const image::Shading& shading);
  void audit(ViewCost& cost) const;

  SteeredSessionConfig config_;
  DirectScene& scene_;
  packer::PackerCore packer_;
  packer::Planner planner_;
  viewer::ModelCache cache_;
  viewer::FineRays fine_rays_;
  std::unique_ptr<viewer::Renderer> renderer_;
  splat::DrawList list_;
  image::View frame_;
  image::PixelMask cast_, needed_;
  wire::PlanRequest request_;  // the newest
  uint64_t frames_ = 0, round_ = 0;
  double footprint_ = 0, rays_ = 0, sampling_s_ = 0;
  bool exhausted_ = true;
};

}  // namespace telesplat::launcher
