#include "client/viewer/points/source.h"

#include <algorithm>

#include "client/viewer/hands/clip_list.h"
#include "common/core/clock.h"
#include "common/image/background.h"

namespace telesplat::viewer {
namespace {

// Share of a frame's time for sub-pixels. The samplers of a small machine need the rest: they have the most to do when
// a head has just come to rest.
constexpr double kStillShare = 0.5;
// Frame period if frames are not paced.
constexpr double kStillPeriod_s = 1.0 / 60;
// Period at which a picture that is not drawn again is reported as seen: packers forget points that no viewer sees.
constexpr double kSeenPeriod_s = 0.5;

int still_side(const DisplayOptions& o) { return o.still_samples >= 16 ? 4 : 2; }

}  // namespace

PointSource::PointSource(const DisplayOptions& options, std::unique_ptr<Renderer> renderer, ReceivedPoints& received)
    : options_(options),
      renderer_(std::move(renderer)),
      received_(received),
      detail_(options.detail, options.target_fps),
      supersampler_(*renderer_, still_side(options)) {}

// Splats that soften their edges let the background through; drawing the same over another background shows how much.
void PointSource::find_coverage(const FrameInput& input, const geometry::Camera& camera, image::View& view) {
  auto shading = options_.shading;
  shading.background = 0xffffff;
  over_white_.width = view.width, over_white_.height = view.height;
  over_white_.colour.resize(view.colour.size());
  renderer_->render(list_, camera, input.look.render, image::Shading(shading, camera),
                    {view.width, view.height, over_white_.colour.data(), nullptr});
  image::find_coverage(over_white_, view);
}

void PointSource::find_coverage(const FrameInput& input, const geometry::Camera& camera,
                                const splat::FrameTarget& target) {
  const size_t pixels = size_t(target.width) * size_t(target.height);
  image::View view{target.width, target.height, {target.colour, target.colour + pixels}, {}};
  find_coverage(input, camera, view);
  std::copy(view.colour.begin(), view.colour.end(), target.colour);
}

bool PointSource::stands_still(const FrameInput& input) {
  head_.frame(input, cut_.version);
  const bool refines = options_.still_samples > 1 && input.look.render.finish.antialias && !options_.transparent;
  if (!refines || !head_.stands_still()) {
    still_shading_.reset();
    return false;
  }
  if (!still_shading_) {
    still_shading_.emplace(options_.shading, input.camera);
    still_.begin(input.camera);
    changes_.any = base_stale_ = true;
  } else {
    still_.on_changes(changes_);
    still_.on_changes(ray_changes_);
  }
  return true;
}

void PointSource::select(const FrameInput& input, double detail, DrawnFrame& out) {
  options_.selection.detail = float(std::min(detail, input.look.most_detail));
  received_.cache().select(out.halved ? geometry::half_size(input.camera) : input.camera, options_.selection, list_);
  clip_list(*cut_.clip, list_);
  out.chosen_s = seen_s_ = monotonic_s();
  if (!input.resting) received_.on_seen(list_.clusters_seen, list_.frames_seen);
}

void PointSource::draw_list(const FrameInput& input, const image::Shading& shading, image::View& view,
                            DrawnFrame& out) {
  splat::RenderOptions render = input.look.render;
  render.halved = out.halved;
  out.stats = renderer_->render(
      list_, input.camera, render, shading,
      {view.width, view.height, view.colour.data(), input.with_depth ? view.depth_m.data() : nullptr});
  drawn_ = out.stats.points_drawn;
}

void PointSource::draw_moving(const FrameInput& input, image::View& view, DrawnFrame& out) {
  const double detail = detail_.wanted(input, list_.distance_m);
  out.halved = detail_.halves() && renderer_->halves() && !input.resting && !input.with_coverage;
  select(input, input.resting ? 1.0 : detail, out);
  if (list_.points > 0 || input.even_empty) draw_list(input, image::Shading(options_.shading, input.camera), view, out);
  if (!input.resting) detail_.measure(input, detail, out, list_, *renderer_);
}

void PointSource::draw_still(const FrameInput& input, image::View& view, DrawnFrame& out) {
  out.chosen_s = input.begin_s;
  if (changes_.any) {
    select(input, 1, out);
    base_stale_ |= splat::names_of(list_) != base_;  // the picture does not have finer points yet
  }
  const bool base = input.with_depth || (!still_.covers_all() && (base_stale_ || !input.intact));
  if (base && !changes_.any) select(input, 1, out);
  if (base) {
    draw_list(input, *still_shading_, view, out);
    base_stale_ = false, base_ = splat::names_of(list_);
  }
  out.changed = base || !input.intact;
  out.still = !base;
  if (out.changed) still_.put_over(view);
  refine(input, view, out);
  if (input.begin_s - seen_s_ < kSeenPeriod_s) return;
  seen_s_ = input.begin_s;
  received_.on_seen(list_.clusters_seen, list_.frames_seen);
}

void PointSource::refine(const FrameInput& input, image::View& view, DrawnFrame& out) {
  const double period_s = options_.target_fps > 0 ? 1 / options_.target_fps : kStillPeriod_s;
  const double begin_s = monotonic_s();
  tile_time_.begin(begin_s, input.begin_s + kStillShare * period_s);
  const Supersampler::Scene scene{
      [this](const geometry::Camera& camera, const splat::SelectionOptions& selection, splat::DrawList& list) {
        received_.cache().select_part(camera, selection, list);
        clip_list(*cut_.clip, list);
      },
      options_.selection, input.look.render, *still_shading_, &received_.fine_rays()};
  for (double now_s = begin_s;;) {
    const auto tile = still_.next(now_s);
    if (!tile || !tile_time_.allows(now_s)) break;
    tile_time_.use();
    const double share = still_.share();
    const bool drawn =
        supersampler_.draw(scene, input.camera, still_.rect(*tile), still_.pixels(*tile), size_t(input.camera.width));
    const double end_s = monotonic_s();
    still_.done(*tile, drawn, end_s);
    if (drawn) {
      still_.put_over(view, *tile);
      out.changed = true;
      out.still = false;
      tile_time_.drawn(end_s - now_s);
    }
    base_stale_ |= still_.share() < share;  // the tile has lost its pixels: draw the picture below it again
    now_s = end_s;
    out.refined.ms = (end_s - begin_s) * 1e3;
  }
  out.refined.share = still_.share();
  out.refined.sub_pixels = supersampler_.side();
}

void PointSource::add_figures(DrawnFrame& out) const {
  out.empty = list_.points == 0;
  out.selected = list_.points;
  out.drawn = out.empty ? 0 : drawn_;
  out.items = list_.items.size();
  out.cached = received_.cache().figures().points_displayed;
  out.sequence = list_.applied.value;
  out.summaries = list_.summaries;
  out.detail = options_.selection.detail;
  out.budget_ms = detail_.budget_ms();
  out.epoch = list_.epoch;
  out.between_clips = list_.epoch.value < cut_.epoch.value;
}

// Runs before anything is drawn: the picture may lack changes that come later.
DrawnFrame PointSource::begin_frame(const FrameInput& input) {
  auto& o = options_;
  put_into(input.look, o.shading);
  o.selection.scale = o.splat_scale > 0 ? o.splat_scale : splat::suitable_scale(input.look.render.kernel);
  o.selection.best_patch_only = received_.keeps_redundant();
  o.selection.eyes.reset();
  DrawnFrame out;
  out.update = received_.shown();
  received_.cache().take_changes(changes_);
  cut_ = received_.cut();
  return out;
}

void PointSource::end_frame(DrawnFrame& out) {
  received_.cache().end_frame();
  add_figures(out);
}

DrawnFrame PointSource::draw(const FrameInput& input, image::View& view) {
  DrawnFrame out = begin_frame(input);
  ray_changes_.clear();
  received_.fine_rays().take_changes(input.camera, ray_changes_);
  if (stands_still(input))
    draw_still(input, view, out);
  else
    draw_moving(input, view, out);
  if (input.with_coverage) find_coverage(input, input.camera, view);
  end_frame(out);
  return out;
}

// If the head stands still, a pair is drawn at full detail, and again only after a change.
DrawnFrame PointSource::draw_pair(const FrameInput& input, const std::array<geometry::Camera, 2>& eyes,
                                  const std::array<splat::FrameTarget, 2>& targets) {
  DrawnFrame out = begin_frame(input);
  options_.selection.eyes = eyes;
  head_.frame(input, cut_.version);
  head_.frame_of(eyes);
  const bool still = head_.stands_still();
  if (still && pair_sharp_ && input.intact && !changes_.any && !input.with_depth && !input.with_coverage) {
    out.changed = false;
    out.still = true;
    out.chosen_s = input.begin_s;
    if (input.begin_s - seen_s_ >= kSeenPeriod_s) {
      seen_s_ = input.begin_s;
      received_.on_seen(list_.clusters_seen, list_.frames_seen);
    }
    end_frame(out);
    return out;
  }
  const double allowed = detail_.wanted(input, list_.distance_m), detail = still || input.resting ? 1 : allowed;
  select(input, detail, out);
  pair_sharp_ = still;
  if (list_.points > 0 || input.even_empty) {
    const image::Shading shading(options_.shading, input.camera);  // both eyes look the same way
    out.stats = renderer_->render_pair(list_, eyes, input.look.render, shading, targets);
    drawn_ = out.stats.points_drawn;
    for (size_t i = 0; i < eyes.size() && input.with_coverage; ++i) find_coverage(input, eyes[i], targets[i]);
  }
  if (!input.resting && !still) detail_.measure(input, detail, out, list_, *renderer_);
  end_frame(out);
  return out;
}

// Picks at full detail, which the frame may not have had time for.
std::optional<Pick> PointSource::pick(const geometry::Camera& camera, double x_pix, double y_pix, double) {
  splat::SelectionOptions selection = options_.selection;
  selection.detail = 1;
  selection.eyes.reset();
  splat::DrawList list;
  received_.cache().select_part(pick_camera(camera, x_pix, y_pix), selection, list);
  clip_list(*cut_.clip, list);
  const auto out = pick_point(list, camera, x_pix, y_pix);
  received_.cache().end_frame();
  return out;
}

}  // namespace telesplat::viewer
