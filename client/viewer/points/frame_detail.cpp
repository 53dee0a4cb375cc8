#include "client/viewer/points/frame_detail.h"

#include "common/core/clock.h"

namespace telesplat::viewer {

// Share of a frame's time for drawing. The rest is for the worker, and the sampler of a small machine.
constexpr double kBudgetShare = 0.85;

FrameDetail::FrameDetail(const DetailOptions& options, double target_fps)
    : options_(options),
      budget_(options.by_budget && target_fps > 0 ? kBudgetShare * 1e3 / target_fps : 0, options.least),
      half_size_(budget_.budget_ms()) {}

double FrameDetail::wanted(const FrameInput& input, double distance_m) {
  if (!input.resting && options_.by_speed) speed_.frame(input.begin_s, input.camera, distance_m > 0 ? distance_m : 1);
  return std::min(budget_.detail(), speed_.detail());
}

void FrameDetail::measure(const FrameInput& input, double detail, const DrawnFrame& drawn, const splat::DrawList& list,
                          const Renderer& renderer) {
  const double end_s = monotonic_s();
  const splat::SplatStats& s = drawn.stats;
  const double threads_ms = s.project_ms + s.resolve_ms + s.fill_ms + s.smooth_ms + s.antialias_ms;
  const double work_ms = s.prepare_ms + threads_ms / std::max(renderer.threads(), 1);
  const double draw_ms = std::min((end_s - drawn.chosen_s) * 1e3, work_ms);
  budget_.frame_done((drawn.chosen_s - input.begin_s) * 1e3, draw_ms, double(list.points), detail);
  if (renderer.halves() && drawn.halved == half_size_.on())
    half_size_.frame_done(draw_ms, budget_.detail() <= options_.least);
}

}  // namespace telesplat::viewer
