#include "client/viewer/viewer_service.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <thread>

#include "client/viewer/display/display_loop.h"
#include "client/viewer/display/headless_surface.h"
#include "client/viewer/display/window_surface.h"
#include "client/viewer/points/source.h"
#include "client/viewer/slices/source.h"
#include "common/core/clock.h"
#include "common/net/control.h"

namespace telesplat::viewer {
namespace {

constexpr double kPicturesAfterSignal_s = 1.0, kMasterPatience_s = 2.0;

Result<geometry::Trajectory> make_trajectory(const std::string& name) {
  if (name == "orbit") return geometry::Trajectory::orbit();
  if (name == "still") return geometry::Trajectory::still(geometry::default_pose());
  return geometry::Trajectory::read_csv(name);
}

int refuse(const Error& error) {
  std::fprintf(stderr, "telesplat: %s\n", error.text.c_str());
  return 2;
}

// To the person: on a terminal as it is, else marked so that the launcher passes it on.
void tell(const std::string& text) {
  std::printf("%s%s\n", isatty(1) ? "" : "note ", text.c_str());
  std::fflush(stdout);
}

// A window may be given another size than it asked for: the options follow.
Result<std::unique_ptr<DisplaySurface>> make_surface(ViewerOptions& o, geometry::Trajectory trajectory) {
  if (!o.window) return std::unique_ptr<DisplaySurface>(new HeadlessSurface(o.display, std::move(trajectory)));
  WindowSurface::Options options{o.display, std::nullopt, o.fullscreen, o.out.empty() ? "." : o.out};
  if (o.trajectory != "still") options.recorded = std::move(trajectory);
  auto opened = WindowSurface::open(options, tell);
  if (!opened) return opened.error();
  o.display.width = (*opened)->width();
  o.display.height = (*opened)->height();
  return std::unique_ptr<DisplaySurface>(std::move(*opened));
}

}  // namespace

int run(ViewerOptions o) {
  log::initialise(o.service.name, o.service.log_level);
  net::install_signal_handlers();
  if (const Status s = settle(o); !s) return refuse(s.error());
  const int buffers = int(o.requests.buffers);
  auto trajectory = make_trajectory(o.trajectory);
  if (!trajectory) return refuse(trajectory.error());
  auto surface =
      make_surface(o, std::move(*trajectory));  // before the renderer, whose context may depend on the window's
  if (!surface) return refuse(surface.error());
  auto renderer = make_renderer(o.renderer, o.threads);
  if (!renderer) {
    log::error("{}", renderer.error().text);
    return 1;
  }
  if (std::string_view((*renderer)->name()) == "cpu")
    o.display.threads = o.threads > 0 ? o.threads : int(std::max(1u, std::thread::hardware_concurrency()));
  std::unique_ptr<FrameSpool> spool;
  const std::string spool_directory = o.out + "/spool";
  if (!o.out.empty()) {
    auto opened = FrameSpool::open(spool_directory);
    if (!opened) return refuse(opened.error());
    spool = std::move(*opened);
  }

  std::unique_ptr<EventRecorder> events;
  if (!o.out.empty() && o.record_points_mb > 0) {
    auto opened = EventRecorder::open(o.out + "/points.events", o.record_points_mb << 20);
    if (!opened) return refuse(opened.error());
    events = std::move(*opened);
  }

  net::Context context;
  ViewerCaches caches(buffers);
  metrics::TableRecorder frames("frames", frame_columns());
  metrics::SpanRecorder spans;
  ReplicaWorker::Options worker_options{
      o.service,
      o.requests,
      {{"coupling", o.coupling},
       {"buffers", std::to_string(buffers)},
       {"renderer", (*renderer)->name()},
       {"splat", o.splat},
       {"finish", splat::finish_name(o.display.render.finish)},
       {"shading", o.shading},
       {"width", std::to_string(o.display.width)},
       {"height", std::to_string(o.display.height)},
       {"sampling_width", std::to_string(o.requests.adaptive ? o.display.width : o.requests.sampling_width)},
       {"sampling_height", std::to_string(o.requests.adaptive ? o.display.height : o.requests.sampling_height)},
       {"sampling", o.requests.adaptive ? "adaptive" : "fixed"},
       {"trajectory", o.trajectory},
       {"fov_deg", fmt::format("{}", o.display.fov_deg)},
       {"target_fps", fmt::format("{}", o.display.target_fps)},
       {"update_rate", fmt::format("{}", o.requests.max_rate_hz)},
       {"splat_scale",
        fmt::format("{}", o.splat_scale > 0 ? o.splat_scale : splat::suitable_scale(o.display.render.kernel))}},
      o.epoch_patience_s,
      events.get(),
      o.started_s};
  if (!o.wall.empty()) {
    worker_options.facts["wall"] = o.wall;
    worker_options.facts["wall_tile"] = std::to_string(o.wall_tile);
  }
  DisplayResult result;
  bool session_ended = false;
  {
    ReplicaWorker worker(context, worker_options, caches, frames, spans);
    const SourceMaker make_source = [&](SceneKind kind) -> Result<std::unique_ptr<ViewSource>> {
      if (kind == SceneKind::kPoints)
        return std::unique_ptr<ViewSource>(new PointSource(o.display, std::move(*renderer), caches, worker));
      renderer->reset();  // its context must not be the current one
      auto volumes = make_volume_renderer(o.renderer, o.threads);
      if (!volumes) return volumes.error();
      return std::unique_ptr<ViewSource>(
          new VolumeSource(std::move(*volumes), caches.slices, o.display.shading.background));
    };
    result = run_display(o.display, **surface, make_source, caches.gate, worker, frames, spans, spool.get());
    session_ended = worker.shutdown_requested();
  }
  if (!result.error.empty()) {
    log::error("{}", result.error);
    return 1;
  }
  surface->reset();  // the window goes at once, whatever there is to write
  if (spool) {
    spool->flush();
    if (spool->dropped()) log::warn("{} frames to record were dropped: the disk did not keep up", spool->dropped());
    const auto progress = [](size_t done, size_t of) {
      std::printf("progress pictures %.3f\n", double(done) / double(of));
      std::fflush(stdout);
    };
    const auto in_time = [signalled_s = 0.0]() mutable {
      if (!net::stop_requested()) return true;
      if (signalled_s == 0) signalled_s = monotonic_s();
      return monotonic_s() - signalled_s < kPicturesAfterSignal_s;
    };
    if (const Status s = develop_frames(spool_directory, o.out + "/images", progress, in_time); !s) {
      log::error("{}", s.error().text);
      return 1;
    }
    std::error_code error;
    if (std::filesystem::is_empty(spool_directory, error)) std::filesystem::remove(spool_directory, error);
  }
  if (!o.end_session) return 0;
  if (!session_ended && !net::stop_requested())
    if (const auto answer = net::ask_master(o.service.master, "stop", kMasterPatience_s); !answer)
      log::warn("the session could not be ended: {}", answer.error().text);
  if (result.frames == 0) log::error("the session ended before anything was shown");
  return result.frames == 0 ? 1 : 0;
}

}  // namespace telesplat::viewer
