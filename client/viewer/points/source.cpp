#include "client/viewer/points/source.h"

#include <algorithm>

#include "common/core/clock.h"
#include "common/image/background.h"

namespace telesplat::viewer {
namespace {

// What is left of a frame's time is for whoever else needs the cores: the worker, the sampler of a small machine.
constexpr double kBudgetShare = 0.85;

}  // namespace

PointSource::PointSource(const DisplayOptions& options, std::unique_ptr<Renderer> renderer, ReceivedPoints& received)
    : options_(options),
      renderer_(std::move(renderer)),
      received_(received),
      budget_(options.detail_budget && options.target_fps > 0 ? kBudgetShare * 1e3 / options.target_fps : 0,
              options.least_detail) {}

// Splats that soften their edges let the background through; which is known from drawing the same over another one.
void PointSource::find_coverage(const FrameInput& input, image::View& view) {
  auto shading = options_.shading;
  shading.background = 0xffffff;
  over_white_.width = view.width, over_white_.height = view.height;
  over_white_.colour.resize(view.colour.size());
  renderer_->render(list_, input.camera, input.look.render, image::Shading(shading, input.camera),
                    {view.width, view.height, over_white_.colour.data(), nullptr});
  image::find_coverage(over_white_, view);
}

DrawnFrame PointSource::draw(const FrameInput& input, image::View& view) {
  auto& o = options_;
  const geometry::Camera& camera = input.camera;
  o.shading.lit = input.look.lit;
  o.selection.scale = o.splat_scale > 0 ? o.splat_scale : splat::suitable_scale(input.look.render.kernel);
  o.selection.best_patch_only = received_.keeps_redundant();
  if (!input.resting) {
    if (o.speed_detail) speed_.frame(input.begin_s, camera, list_.distance_m > 0 ? list_.distance_m : 1);
    o.selection.detail = float(std::min(budget_.detail(), speed_.detail()));
  }
  received_.cache().select(camera, o.selection, list_);
  DrawnFrame out;
  out.empty = list_.points == 0;
  out.chosen_s = monotonic_s();
  splat::SplatStats stats;
  if (!out.empty || input.even_empty)
    stats = renderer_->render(
        list_, camera, input.look.render, image::Shading(o.shading, camera),
        {camera.width, camera.height, view.colour.data(), input.with_depth ? view.depth_m.data() : nullptr});
  const double end_s = monotonic_s();
  if (input.with_coverage) find_coverage(input, view);
  received_.cache().end_frame();
  if (!input.resting) {
    // What this frame cost by itself: that samplers held a core for a while is no reason for a coarser picture.
    const double work_ms = stats.prepare_ms + (stats.project_ms + stats.resolve_ms + stats.fill_ms + stats.smooth_ms +
                                               stats.antialias_ms) /
                                                  std::max(o.threads, 1);
    budget_.frame_done((out.chosen_s - input.begin_s) * 1e3, std::min((end_s - out.chosen_s) * 1e3, work_ms),
                       double(list_.points), o.selection.detail);
    received_.on_seen(list_.clusters_seen, list_.frames_seen);
  }
  out.project_cpu_ms = stats.project_ms;
  out.resolve_cpu_ms = stats.resolve_ms;
  out.fill_cpu_ms = stats.fill_ms;
  out.smooth_cpu_ms = stats.smooth_ms;
  out.antialias_cpu_ms = stats.antialias_ms;
  out.selected = list_.points;
  out.drawn = stats.points_drawn;
  out.items = list_.items.size();
  out.cached = received_.cache().figures().points_displayed;
  out.sequence = list_.applied.value;
  out.summaries = list_.summaries;
  out.detail = o.selection.detail;
  out.budget_ms = budget_.budget_ms();
  out.epoch = list_.epoch;
  out.update = received_.shown();
  return out;
}

}  // namespace telesplat::viewer
