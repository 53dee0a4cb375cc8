#include "client/viewer/display/display_loop.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "common/core/clock.h"

namespace telesplat::viewer {
namespace {

constexpr double kPicturePeriod_s = 2.5, kRestPeriod_s = 1.0 / 30, kLookAfterSurface_s = 0.1;

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

LiveFigures live_figures(double now_s, uint64_t frames, const DrawnFrame& drawn, const ViewSource& source,
                         const ReplicaWorker& worker) {
  const auto network = worker.figures();
  return {now_s,
          network.scene,
          network.extent_m,
          frames,
          network.updates,
          network.latency_ms,
          drawn.drawn,
          drawn.cached,
          network.bytes_received,
          network.epochs_shown,
          source.drawn_name(),
          source.cached_name()};
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
                                                "epoch",
                                                "wait_ms",
                                                "request",
                                                "buffers_filled"};
  return columns;
}

namespace {

class Display {
 public:
  Display(const DisplayOptions& o, DisplaySurface& surface, CouplingGate& gate, ReplicaWorker& worker,
          metrics::TableRecorder& frames, metrics::SpanRecorder& spans, FrameSpool* spool)
      : o_(o),
        surface_(surface),
        gate_(gate),
        worker_(worker),
        frames_(frames),
        spans_(spans),
        spool_(spool),
        look_{o.render, o.shading.lit} {}

  DisplayResult run(const SourceMaker& make_source) {
    if (!wait_for_scene()) return {0, true, {}};
    auto made = make_source(worker_.kind());
    if (!made) return {0, true, made.error().text};
    source_ = std::move(*made);
    if (!rest()) return {0, true, {}};
    worker_.on_first_points(monotonic_s());
    start_s_ = o_.clock_from_s > 0 ? o_.clock_from_s : monotonic_s();
    while (!last_) frame();
    return result_;
  }

 private:
  // Until it is known what there is to show.
  bool wait_for_scene() {
    for (; worker_.kind() == SceneKind::kUnknown; sleep_until(monotonic_s() + kRestPeriod_s)) {
      if (told_to_stop(worker_, surface_)) return false;
      const geometry::Camera camera = surface_.begin_frame(monotonic_s(), -1, look_);
      if (!surface_.visible()) continue;
      fit(view_, camera, false);
      std::fill(view_.colour.begin(), view_.colour.end(), o_.shading.background);
      surface_.present(view_);
      const auto network = worker_.figures();
      surface_.report({.now_s = monotonic_s(), .scene = network.scene, .extent_m = network.extent_m});
    }
    return true;
  }

  // The head rests until the first view is complete; what comes of it is shown as it comes, unless the display waits for whole updates.
  bool rest() {
    for (; !worker_.first_update_complete(); sleep_until(monotonic_s() + kRestPeriod_s)) {
      if (told_to_stop(worker_, surface_)) return false;
      const double now_s = monotonic_s();
      const geometry::Camera camera = surface_.begin_frame(now_s, -1, look_);
      worker_.on_pose(now_s, camera);
      fit(view_, camera, spool_ != nullptr);
      const DrawnFrame drawn = source_->draw({now_s, camera, look_, false, true, surface_.visible()}, view_);
      if (drawn.empty && !surface_.visible()) continue;
      surface_.present(view_);
      if (!drawn.empty) worker_.on_first_points(monotonic_s());
      surface_.report(live_figures(monotonic_s(), 0, drawn, *source_, worker_));
    }
    return true;
  }

  // Whether the frame that begins now is the last one.
  void see_whether_last(double t_s) {
    if (told_to_stop(worker_, surface_)) result_.interrupted = last_ = true;
    last_ = last_ || (o_.duration_s > 0 && t_s >= o_.duration_s) || (o_.frames > 0 && result_.frames + 1 >= o_.frames);
  }

  // Where the display waits for updates: until the next one is there, or the end has come. Seconds that it took.
  double wait_for_update() {
    if (!gate_.waits()) return 0;
    const double begin_s = monotonic_s();
    for (;;) {
      if (const auto request = gate_.take(kLookAfterSurface_s)) {
        source_->advance(*request);
        return monotonic_s() - begin_s;
      }
      const double now_s = monotonic_s(), t_s = now_s - start_s_;
      if (told_to_stop(worker_, surface_) || (o_.duration_s > 0 && t_s >= o_.duration_s)) return now_s - begin_s;
      worker_.on_pose(now_s, surface_.begin_frame(now_s, t_s, look_));
      if (view_intact_ && surface_.visible()) surface_.present(view_);
    }
  }

  uint32_t use_of_frame(double t_s) const {
    if (!spool_) return 0;
    uint32_t use = 0;
    if (o_.picture_every ? result_.frames % o_.picture_every == 0 : t_s >= next_picture_s_ || last_)
      use |= o_.exr ? kPicture | kExr : kPicture;
    if (o_.verify_every && (result_.frames % o_.verify_every == 0 || last_)) use |= kVerify;
    return use;
  }

  void frame() {
    const double wait_s = wait_for_update();
    const double begin_s = monotonic_s(), t_s = begin_s - start_s_;
    see_whether_last(t_s);
    // The view of now, from what is cached now.
    const geometry::Camera camera = surface_.begin_frame(begin_s, t_s, look_);
    const uint32_t use = use_of_frame(t_s);
    const bool with_depth = use & (kVerify | kExr);
    fit(view_, camera, spool_ != nullptr);
    const DrawnFrame drawn = source_->draw({begin_s, camera, look_, with_depth}, view_);
    const double end_s = monotonic_s();
    worker_.on_frame(end_s, camera, drawn.epoch, gate_.waits() ? &drawn.update : nullptr);
    surface_.present(view_);
    const double presented_s = monotonic_s();
    const int filled = gate_.filled();
    source_->displayed();
    gate_.displayed();
    add_row(begin_s, end_s, presented_s, camera, drawn, wait_s, filled);
    view_intact_ = use == 0;
    if (use) {
      if (use & kPicture) next_picture_s_ = (std::floor(t_s / kPicturePeriod_s) + 1) * kPicturePeriod_s;
      view_ = spool_->exchange({result_.frames, t_s, use, camera, std::move(view_), drawn.epoch});
    }
    ++result_.frames;
    surface_.report(live_figures(presented_s, result_.frames, drawn, *source_, worker_));
    if (o_.target_fps > 0) sleep_until(next_frame_s(begin_s));
  }

  // Frames are due at equal distances: one that began late, because sleep ended late, does not delay those after it.
  double next_frame_s(double begin_s) {
    const double period_s = 1.0 / o_.target_fps;
    due_s_ = begin_s - due_s_ < period_s ? due_s_ + period_s : begin_s + period_s;
    return due_s_;
  }

  void add_row(double begin_s, double end_s, double presented_s, const geometry::Camera& camera, const DrawnFrame& d,
               double wait_s, int filled) {
    const auto& p = camera.pose.position_room;
    const auto& q = camera.pose.orientation;
    frames_.add({double(result_.frames),
                 begin_s - start_s_,
                 previous_s_ > 0 ? (end_s - previous_s_) * 1e3 : 0.0,
                 (end_s - begin_s) * 1e3,
                 (d.chosen_s - begin_s) * 1e3,
                 (end_s - d.chosen_s) * 1e3,
                 d.project_cpu_ms,
                 d.resolve_cpu_ms,
                 d.fill_cpu_ms,
                 d.smooth_cpu_ms,
                 d.antialias_cpu_ms,
                 double(d.selected),
                 double(d.drawn),
                 double(d.items),
                 double(d.cached),
                 double(d.sequence),
                 (worker_.to_master_s(end_s) - d.update.requested_s) * 1e3,
                 glm::distance(p, d.update.pose.position_room),
                 angle_deg(q, d.update.pose.orientation),
                 p.x,
                 p.y,
                 p.z,
                 q.w,
                 q.x,
                 q.y,
                 q.z,
                 (presented_s - end_s) * 1e3,
                 d.detail,
                 d.budget_ms,
                 double(d.epoch.value),
                 wait_s * 1e3,
                 double(d.update.request.value),
                 double(filled)});
    if (wait_s > 0)
      spans_.add("wait for update", worker_.to_master_s(begin_s - wait_s), worker_.to_master_s(begin_s), 0);
    spans_.add("display frame", worker_.to_master_s(begin_s), worker_.to_master_s(end_s), 0);
    previous_s_ = end_s;
  }

  const DisplayOptions& o_;
  DisplaySurface& surface_;
  CouplingGate& gate_;
  ReplicaWorker& worker_;
  metrics::TableRecorder& frames_;
  metrics::SpanRecorder& spans_;
  FrameSpool* spool_;
  Look look_;
  std::unique_ptr<ViewSource> source_;
  image::View view_;
  bool view_intact_ = false;  // it holds what is on display
  DisplayResult result_;
  double due_s_ = 0;  // when the frame at hand was
  double start_s_ = 0, previous_s_ = 0, next_picture_s_ = 0;
  bool last_ = false;
};

}  // namespace

DisplayResult run_display(const DisplayOptions& options, DisplaySurface& surface, const SourceMaker& make_source,
                          CouplingGate& gate, ReplicaWorker& worker, metrics::TableRecorder& frames,
                          metrics::SpanRecorder& spans, FrameSpool* spool) {
  return Display(options, surface, gate, worker, frames, spans, spool).run(make_source);
}

}  // namespace telesplat::viewer
