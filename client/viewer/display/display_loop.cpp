#include "client/viewer/display/display_loop.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "common/core/clock.h"
#include "common/splat/frame_budget.h"

namespace telesplat::viewer {
namespace {

constexpr double kPicturePeriod_s = 2.5, kBudgetShare = 0.85;

bool told_to_stop(const ReplicaWorker& worker, const DisplaySurface& surface) {
  return net::stop_requested() || worker.shutdown_requested() || surface.wants_to_stop();
}

void sleep_until(double t_s) {
  const double wait_s = t_s - monotonic_s();
  if (wait_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
}

double angle_deg(const glm::dquat& a, const glm::dquat& b) {
  return 2 * std::acos(std::min(1.0, std::abs(glm::dot(a, b)))) * 180 / 3.14159265358979323846;
}

// Room for a frame of this camera. A view that may be recorded has room for depth all the time: growing it costs milliseconds.
void fit(image::View& view, const geometry::Camera& camera, bool with_depth) {
  const size_t pixels = size_t(camera.width) * size_t(camera.height);
  view.width = camera.width;
  view.height = camera.height;
  view.colour.resize(pixels);
  view.depth_m.resize(with_depth ? pixels : 0);
}

LiveFigures live_figures(double now_s, uint64_t frames, uint64_t points_drawn, const ModelCache& cache,
                         const ReplicaWorker& worker) {
  const auto network = worker.figures();
  return {now_s,
          network.scene,
          network.extent_m,
          frames,
          network.updates,
          network.latency_ms,
          points_drawn,
          cache.figures().points_displayed,
          network.bytes_received,
          network.epochs_shown};
}

}  // namespace

const std::vector<std::string>& frame_columns() {
  static const std::vector<std::string> columns{"frame",
                                                "t_s",
                                                "inter_frame_ms",
                                                "construction_ms",
                                                "select_ms",
                                                "render_ms",
                                                "project_cpu_ms",
                                                "resolve_cpu_ms",
                                                "fill_cpu_ms",
                                                "smooth_cpu_ms",
                                                "antialias_cpu_ms",
                                                "points_selected",
                                                "points_drawn",
                                                "items",
                                                "points_cached",
                                                "sequence",
                                                "update_age_ms",
                                                "view_error_m",
                                                "view_error_deg",
                                                "px",
                                                "py",
                                                "pz",
                                                "qw",
                                                "qx",
                                                "qy",
                                                "qz",
                                                "present_ms",
                                                "detail",
                                                "budget_ms",
                                                "epoch"};
  return columns;
}

DisplayResult run_display(const DisplayOptions& options, DisplaySurface& surface, Renderer& renderer, ModelCache& cache,
                          ReplicaWorker& worker, metrics::TableRecorder& frames, metrics::SpanRecorder& spans,
                          FrameSpool* spool) {
  DisplayOptions o = options;
  Look look{o.render, o.shading.lit};
  const auto begin_frame = [&](double now_s, double t_s) {
    const geometry::Camera camera = surface.begin_frame(now_s, t_s, look);
    o.render = look.render;
    o.shading.lit = look.lit;
    o.selection.scale = o.splat_scale > 0 ? o.splat_scale : splat::suitable_scale(look.render.kernel);
    o.selection.best_patch_only = worker.keeps_redundant();
    return camera;
  };
  image::View view;
  splat::DrawList list;

  // Start-up: the head rests until the first view is complete, its points are shown as they come.
  while (!worker.first_update_complete()) {
    if (told_to_stop(worker, surface)) return {0, true};
    const geometry::Camera camera = begin_frame(monotonic_s(), -1);
    worker.on_pose(monotonic_s(), camera);
    cache.select(camera, o.selection, list);
    fit(view, camera, spool != nullptr);
    if (list.points > 0 || surface.visible()) {
      const auto stats = renderer.render(list, camera, o.render, image::Shading(o.shading, camera),
                                         {camera.width, camera.height, view.colour.data(), nullptr});
      surface.present(view);
      if (list.points > 0) worker.on_first_points(monotonic_s());
      surface.report(live_figures(monotonic_s(), 0, stats.points_drawn, cache, worker));
    }
    cache.end_frame();
    sleep_until(monotonic_s() + 1.0 / 30);
  }
  worker.on_first_points(monotonic_s());

  // What is left of a frame's time is for whoever else needs the cores: the worker, the sampler of a small machine.
  splat::FrameBudget budget(o.detail_budget && o.target_fps > 0 ? kBudgetShare * 1e3 / o.target_fps : 0,
                            o.least_detail);
  splat::SpeedDetail speed;
  DisplayResult result;
  const double start_s = monotonic_s();
  double previous_s = 0, next_picture_s = 0;
  bool last = false;
  while (!last) {
    const double begin_s = monotonic_s(), t_s = begin_s - start_s;
    if (told_to_stop(worker, surface)) {
      result.interrupted = true;
      last = true;
    }
    last = last || (o.duration_s > 0 && t_s >= o.duration_s) || (o.frames > 0 && result.frames + 1 >= o.frames);

    // The view of now, from what is cached now.
    const geometry::Camera camera = begin_frame(begin_s, t_s);
    const image::Shading shading(o.shading, camera);
    if (o.speed_detail) speed.frame(begin_s, camera, list.distance_m > 0 ? list.distance_m : 1);
    o.selection.detail = float(std::min(budget.detail(), speed.detail()));
    cache.select(camera, o.selection, list);
    const double selected_s = monotonic_s();
    uint32_t use = 0;
    if (spool) {
      if (o.picture_every ? result.frames % o.picture_every == 0 : t_s >= next_picture_s || last)
        use |= o.exr ? kPicture | kExr : kPicture;
      if (o.verify_every && (result.frames % o.verify_every == 0 || last)) use |= kVerify;
    }
    const bool with_depth = use & (kVerify | kExr);
    fit(view, camera, spool != nullptr);
    const auto stats =
        renderer.render(list, camera, o.render, shading,
                        {camera.width, camera.height, view.colour.data(), with_depth ? view.depth_m.data() : nullptr});
    cache.end_frame();
    const double end_s = monotonic_s();
    // What this frame cost by itself: that samplers held a core for a while is no reason for a coarser picture.
    const double work_ms = stats.prepare_ms + (stats.project_ms + stats.resolve_ms + stats.fill_ms + stats.smooth_ms +
                                               stats.antialias_ms) /
                                                  std::max(o.threads, 1);
    budget.frame_done((selected_s - begin_s) * 1e3, std::min((end_s - selected_s) * 1e3, work_ms), double(list.points),
                      o.selection.detail);
    worker.on_frame(end_s, camera, list);
    surface.present(view);
    const double presented_s = monotonic_s();

    const auto update = worker.last_update();
    const auto figures = cache.figures();
    const auto& p = camera.pose.position_room;
    const auto& q = camera.pose.orientation;
    frames.add({double(result.frames),
                t_s,
                previous_s > 0 ? (end_s - previous_s) * 1e3 : 0.0,
                (end_s - begin_s) * 1e3,
                (selected_s - begin_s) * 1e3,
                (end_s - selected_s) * 1e3,
                stats.project_ms,
                stats.resolve_ms,
                stats.fill_ms,
                stats.smooth_ms,
                stats.antialias_ms,
                double(list.points),
                double(stats.points_drawn),
                double(list.items.size()),
                double(figures.points_displayed),
                double(list.applied.value),
                (worker.to_master_s(end_s) - update.requested_s) * 1e3,
                glm::distance(p, update.pose.position_room),
                angle_deg(q, update.pose.orientation),
                p.x,
                p.y,
                p.z,
                q.w,
                q.x,
                q.y,
                q.z,
                (presented_s - end_s) * 1e3,
                o.selection.detail,
                budget.budget_ms(),
                double(list.epoch.value)});
    spans.add("display frame", worker.to_master_s(begin_s), worker.to_master_s(end_s), 0);
    previous_s = end_s;
    if (use) {
      if (use & kPicture) next_picture_s = t_s + kPicturePeriod_s;
      view = spool->exchange({result.frames, t_s, use, camera, std::move(view), list.epoch});
    }
    ++result.frames;
    surface.report(live_figures(presented_s, result.frames, stats.points_drawn, cache, worker));
    if (o.target_fps > 0) sleep_until(begin_s + 1.0 / o.target_fps);
  }
  return result;
}

}  // namespace telesplat::viewer
