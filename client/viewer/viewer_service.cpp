#include "client/viewer/viewer_service.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "client/viewer/display/headless_surface.h"
#include "client/viewer/display/point_source.h"
#include "client/viewer/display/volume_source.h"
#include "client/viewer/display/window_surface.h"
#include "common/core/clock.h"
#include "common/net/control.h"

namespace telesplat::viewer {
namespace {

constexpr int kMaxWallSide = 16;
constexpr double kPicturesAfterSignal_s = 1.0, kMasterPatience_s = 2.0;

Result<geometry::Trajectory> make_trajectory(const std::string& name) {
  if (name == "orbit") return geometry::Trajectory::orbit();
  if (name == "still") return geometry::Trajectory::still(geometry::default_pose());
  return geometry::Trajectory::read_csv(name);
}

void add_switch(CLI::App& app, const char* flag, bool& value, const char* text) {
  app.add_option_function<std::string>(
         flag, [&value](const std::string& v) { value = v == "on"; }, text)
      ->default_str(value ? "on" : "off")
      ->check(CLI::IsMember({"on", "off"}));
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

Result<std::pair<int, int>> parse_sampling_size(const std::string& text) {
  if (text == "auto") return std::pair{RequestOptions{}.sampling_width, RequestOptions{}.sampling_height};
  return parse_size(text, "--sampling-size");
}

Result<std::pair<int, int>> parse_size(const std::string& text, const char* flag) {
  int w = 0, h = 0;
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, w);
  const bool cross = first.ec == std::errc() && first.ptr != end && *first.ptr == 'x';
  const auto second = cross ? std::from_chars(first.ptr + 1, end, h) : first;
  if (!cross || second.ec != std::errc() || second.ptr != end || w < 16 || h < 16 || w > geometry::kMaxImageSide ||
      h > geometry::kMaxImageSide)
    return Error{fmt::format("{} {}: not WIDTHxHEIGHT with both in 16..{}", flag, text, geometry::kMaxImageSide)};
  return std::pair{w, h};
}

Result<std::pair<int, int>> parse_wall(const std::string& text) {
  int columns = 0, rows = 0;
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, columns);
  const bool cross = first.ec == std::errc() && first.ptr != end && *first.ptr == 'x';
  const auto second = cross ? std::from_chars(first.ptr + 1, end, rows) : first;
  if (!cross || second.ec != std::errc() || second.ptr != end || columns < 1 || rows < 1 || columns > kMaxWallSide ||
      rows > kMaxWallSide)
    return Error{fmt::format("--wall {}: not COLUMNSxROWS with both in 1..{}", text, kMaxWallSide)};
  return std::pair{columns, rows};
}

void add_view_flags(CLI::App& app, ViewerOptions& o) {
  auto& d = o.display;
  app.add_option("--size", o.size, "display size in pixels, WxH")->capture_default_str();
  app.add_option("--sampling-size", o.sampling_size,
                 "sampling size in pixels, WxH; auto: from --least-sampling of the display's to all of it, as fine as "
                 "updates of "
                 "--target-latency allow")
      ->capture_default_str();
  app.add_option("--least-sampling", o.requests.min_scale,
                 "--sampling-size auto: sampled pixels a displayed pixel, on each axis, at least")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 1.0));
  app.add_option("--target-latency", o.requests.target_latency_s,
                 "seconds from request to complete view update that --sampling-size auto aims at")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 10.0));
  app.add_option("--trajectory", o.trajectory, "orbit, still, or a CSV file t_s,px,py,pz,qw,qx,qy,qz (room space)")
      ->capture_default_str();
  app.add_option("--duration", d.duration_s, "seconds from the first displayed frame; 0: until stopped")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--frames", d.frames, "frames to display; 0: no limit")->capture_default_str();
  app.add_option("--hold", d.hold_s, "the head stands still for the last so many seconds")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--fov", d.fov_deg, "horizontal field of view, degrees")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 170.0));
  app.add_option("--near", d.near_m, "nearest depth seen, metres")->capture_default_str()->check(CLI::Range(1e-5, 1e3));
  app.add_option("--target-fps", d.target_fps, "display rate aimed at; 0: as fast as possible")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1000.0));
  add_switch(app, "--detail-budget", d.detail_budget,
             "on: lower detail where a view takes longer to construct than --target-fps leaves time for");
  app.add_option("--least-detail", d.least_detail, "the budget lowers detail no further than this")
      ->capture_default_str()
      ->check(CLI::Range(0.3, 1.0));
  add_switch(app, "--speed-detail", d.speed_detail, "on: lower detail while the head moves fast");
  app.add_option("--renderer", o.renderer, "auto, cpu or gl")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "cpu", "gl"}));
  app.add_option("--splat", o.splat, "kernel: square, disc, ellipse or ewa")
      ->capture_default_str()
      ->check(CLI::IsMember({"square", "disc", "ellipse", "ewa"}));
  app.add_option("--splat-scale", o.splat_scale, "scale factor of splat sizes; 0: what suits the kernel")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 10.0));
  app.add_option("--finish", o.finish, "work per pixel after splatting: on, off, or some of fill,smooth,antialias")
      ->capture_default_str()
      ->check([](const std::string& v) {
        return splat::finish_named(v) ? "" : v + ": not on, off or some of fill,smooth,antialias";
      });
  app.add_option("--shading", o.shading,
                 "lit: head light, directional light, ambient; head: head light; unlit: colours as they are")
      ->capture_default_str()
      ->check(CLI::IsMember(image::kShadingNames));
  app.add_option("--coupling", o.coupling,
                 "async: the display never waits for the server; sync: each frame asks for a view update and waits for "
                 "it; loose: each frame waits for the next update, --buffers of them are asked for ahead")
      ->capture_default_str()
      ->check(CLI::IsMember({"async", "sync", "loose"}));
  app.add_option("--buffers", o.buffers,
                 "--coupling loose: view updates that are on their way or complete and not displayed, at most")
      ->capture_default_str()
      ->check(CLI::Range(uint64_t{1}, wire::kMaxBuffers));
  app.add_option("--update-rate", o.requests.max_rate_hz, "--coupling async: view requests a second at most")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 1000.0));
  app.add_option("--epoch-patience", o.epoch_patience_s,
                 "seconds that a changed scene's last picture is kept while the new one is incomplete")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 60.0));
  app.add_option("--record-every", d.picture_every, "record every N-th frame as a PNG; 0: one every 2.5 s and the last")
      ->capture_default_str();
  app.add_option("--record-points", o.record_points_mb,
                 "keep the point model's events in OUT/points.events for telesplat compare, MiB at most; 0: do not")
      ->capture_default_str()
      ->check(CLI::Range(0, 1 << 20));
  app.add_flag("--exr", d.exr, "record pictures as EXR with depth too");
  app.add_option("--verify", d.verify_every, "compare every N-th frame with direct rendering after the run; 0: none")
      ->capture_default_str();
}

void add_flags(CLI::App& app, ViewerOptions& o) {
  net::add_service_flags(app, o.service, net::Ends::kConnects);
  add_view_flags(app, o);
  app.add_option("--threads", o.threads, "threads to draw with; 0: one a core")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  app.add_option("--started-at", o.started_s,
                 "monotonic clock when the session was started, for start-up times; 0: now")
      ->capture_default_str();
  app.add_option("--wall", o.wall,
                 "COLUMNSxROWS: this display is a tile of a wall; --fov is the wall's, --size the tile's");
  app.add_option("--wall-tile", o.wall_tile, "which tile, counted by rows from the upper left, from 0")
      ->capture_default_str();
  app.add_option("--clock-from", o.display.clock_from_s,
                 "monotonic clock when the head's movement and --duration begin, for several viewers that follow one "
                 "head; 0: with the first displayed frame")
      ->capture_default_str();
  app.add_option("--out", o.out, "run folder for pictures and frames to verify");
  app.add_flag("--end-session", o.end_session, "when this viewer is done, the session is over for everyone");
  app.add_flag("--window", o.window, "show a window; the person at it moves the camera");
  app.add_flag("--fullscreen", o.fullscreen, "the window fills the screen");
}

int run(ViewerOptions o) {
  log::initialise(o.service.name, o.service.log_level);
  net::install_signal_handlers();
  const auto size = parse_size(o.size, "--size"), sampling = parse_sampling_size(o.sampling_size);
  if (!size) return refuse(size.error());
  if (!sampling) return refuse(sampling.error());
  std::tie(o.display.width, o.display.height) = *size;
  std::tie(o.requests.sampling_width, o.requests.sampling_height) = *sampling;
  const auto wall = parse_wall(o.wall.empty() ? "1x1" : o.wall);
  if (!wall) return refuse(wall.error());
  std::tie(o.display.wall.columns, o.display.wall.rows) = *wall;
  if (o.wall_tile < 0 || o.wall_tile >= wall->first * wall->second)
    return refuse({fmt::format("--wall-tile {}: --wall {} has the tiles 0..{}", o.wall_tile,
                               o.wall.empty() ? "1x1" : o.wall, wall->first * wall->second - 1)});
  o.display.wall.tile = o.wall_tile;
  const auto coupling = coupling_named(o.coupling);
  if (!coupling) return refuse({fmt::format("--coupling {}: not async, sync or loose", o.coupling)});
  if (o.buffers < 1 || uint64_t(o.buffers) > wire::kMaxBuffers)
    return refuse({fmt::format("--buffers {}: not in 1..{}", o.buffers, wire::kMaxBuffers)});
  const int buffers = buffers_of(*coupling, o.buffers);
  o.display.render.kernel = *splat::kernel_named(o.splat);
  o.display.splat_scale = float(o.splat_scale);
  o.display.shading = *image::shading_named(o.shading);
  o.display.render.finish = *splat::finish_named(o.finish);
  if (o.display.duration_s > 0) o.display.hold_s = std::min(o.display.hold_s, o.display.duration_s);
  o.requests.adaptive = o.sampling_size == "auto";
  o.requests.follow_display = o.window;
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
