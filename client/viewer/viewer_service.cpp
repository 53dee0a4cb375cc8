#include "client/viewer/viewer_service.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>

#include "client/viewer/display/display_loop.h"
#include "client/viewer/display/headless_surface.h"
#include "client/viewer/display/window_surface.h"
#include "client/viewer/session_record.h"
#include "client/viewer/xr/xr_display.h"
#include "common/core/clock.h"
#include "common/core/file_hash.h"
#include "common/core/log.h"
#include "common/core/machine.h"
#include "common/metrics/about.h"
#include "common/net/control.h"

namespace telesplat::viewer {
namespace {

constexpr double kPicturesAfterSignal_s = 1.0, kMasterPatience_s = 2.0;

int fail(const Error& error) {
  log::error("{}", error.text);
  return 1;
}

// The launcher reads it: this is no reason to end the session for others.
int not_recorded(const std::string& directory, const std::string& why) {
  const std::string text = fmt::format("{}: not all of the record could be written: {}", directory, why);
  if (!isatty(STDOUT_FILENO)) std::printf("record failed %s\n", text.c_str());
  std::fflush(stdout);
  return fail({text});
}

// To the person: on a terminal as it is, else marked so that the launcher passes it on.
void tell(const std::string& text) {
  std::printf("%s%s\n", isatty(1) ? "" : "note ", text.c_str());
  std::fflush(stdout);
}

// The launcher reads it.
void ask_to_open(const std::string& path) {
  if (path.find('\n') != path.npos) return;
  std::printf("open %s\n", path.c_str());
  std::fflush(stdout);
}

// Null: nobody publishes poses.
Result<std::shared_ptr<PoseFeed>> open_poses(const ViewerOptions& o) {
  if (o.poses.empty()) return std::shared_ptr<PoseFeed>();
  auto opened = PoseFeed::open({o.poses, o.requests.prediction, o.pose_horizon_s});
  if (!opened) return opened.error();
  return std::shared_ptr<PoseFeed>(std::move(*opened));
}

// A window may be given another size than it asked for: the options follow.
Result<std::unique_ptr<DisplaySurface>> open_surface(ViewerOptions& o, const net::Access& asking,
                                                     const std::shared_ptr<PoseFeed>& poses) {
  if (!o.window) {
    if (const std::string end = end_of_trajectory(o); !end.empty()) log::info("{}", end);
    auto made = std::make_unique<HeadlessSurface>(o.display, o.movement, tell);
    if (poses) made->follow(poses);
    return std::unique_ptr<DisplaySurface>(std::move(made));
  }
  const std::string folder = o.out.empty() ? "." : o.out;
  const auto& r = o.requests;
  const WindowSurface::Options options{
      .display = o.display,
      .movement = o.movement,
      .poses = poses,
      .fullscreen = o.fullscreen,
      .screenshot_directory = o.out.empty() ? "." : o.out + "/images",
      .path_directory = folder,
      .panel = o.panel,
      .viewer = o.service.name,
      .sampling = {r.adaptive, r.sampling_width, r.sampling_height, o.least_sampling.value_or(r.min_scale)},
      .sampling_chosen = o.least_sampling.has_value(),
      .open = o.launched ? std::function<void(const std::string&)>(ask_to_open) : nullptr,
      .recorded = !o.out.empty(),
      .begins_empty = o.begins_empty,
      .launcher_fd = o.launched ? STDIN_FILENO : -1};
  auto opened = WindowSurface::open(options, tell, std::make_unique<ControlDesk>(o.service.master, asking));
  if (!opened) return opened.error();
  o.display.width = (*opened)->width();
  o.display.height = (*opened)->height();
  if (const auto& panel = o.display.stereo.panel;
      panel && (panel->width != o.display.width || panel->height != o.display.height))
    tell(
        fmt::format("the window has {}x{} pixels and the autostereo display of --barrier {}x{}: it must fill that "
                    "display pixel by pixel (--fullscreen)",
                    o.display.width, o.display.height, panel->width, panel->height));
  return std::unique_ptr<DisplaySurface>(std::move(*opened));
}

// Where frames go, and who moves the head.
struct Display {
  std::unique_ptr<DisplaySurface> surface;  // null: a headset's
  std::unique_ptr<XrDevice> headset;
  std::shared_ptr<PoseFeed> poses;  // null: nobody publishes any
};

// A headset wants pictures of another size than the options tell: they follow.
Result<Display> open_display(ViewerOptions& o, const net::Access& asking, const std::shared_ptr<PoseFeed>& poses) {
  Display out{nullptr, nullptr, poses};
  if (o.xr) {
    auto headset = XrDevice::open();
    if (!headset) return Error{"--xr: " + headset.error().text};
    out.headset = std::move(*headset);
    const auto& eye = out.headset->system().eye_size();
    o.display.width = eye.width;
    o.display.height = eye.height;
    return out;
  }
  auto surface = open_surface(o, asking, poses);
  if (!surface) return surface.error();
  out.surface = std::move(*surface);
  return out;
}

Result<Renderers> open_renderers(ViewerOptions& o) {
  auto renderers = Renderers::make(o.renderer, o.threads);
  if (renderers && std::string_view(renderers->name()) == "cpu")
    o.display.threads = o.threads > 0 ? o.threads : usable_processors();
  return renderers;
}

Result<std::unique_ptr<SessionRecord>> open_record(const ViewerOptions& o) {
  return SessionRecord::open(
      {.out = o.out, .join = o.join_record, .name = o.service.name, .received_mb = o.record_points_mb});
}

// The file that the head follows.
void add_trajectory(std::map<std::string, std::string>& facts, const ViewerOptions& o) {
  facts["trajectory"] = o.trajectory;
  if (!o.movement.recorded) return;
  std::error_code error;
  facts["trajectory_file"] = std::filesystem::absolute(o.trajectory, error).lexically_normal().string();
  if (const auto hash = hash_of_files({o.trajectory})) facts["trajectory_hash"] = hash_text(hash->hash);
}

// What the master is told of this viewer.
std::map<std::string, std::string> facts(const ViewerOptions& o, const Renderers& renderers) {
  const auto& d = o.display;
  const auto& r = o.requests;
  const double scale = o.splat_scale > 0 ? o.splat_scale : splat::suitable_scale(d.render.kernel);
  std::map<std::string, std::string> out{{"coupling", o.coupling},
                                         {"buffers", std::to_string(r.buffers)},
                                         {"renderer", renderers.name()},
                                         {"splat", o.splat},
                                         {"finish", splat::finish_name(d.render.finish)},
                                         {"shading", o.shading},
                                         {"width", std::to_string(d.width)},
                                         {"height", std::to_string(d.height)},
                                         {"sampling_width", std::to_string(r.adaptive ? d.width : r.sampling_width)},
                                         {"sampling_height", std::to_string(r.adaptive ? d.height : r.sampling_height)},
                                         {"sampling", r.adaptive ? "adaptive" : "fixed"},
                                         {"duration_s", fmt::format("{}", d.duration_s)},
                                         {"frames", std::to_string(d.frames)},
                                         {"hold_s", fmt::format("{}", d.hold_s)},
                                         {"prediction", o.prediction},
                                         {"verify_every", std::to_string(d.verify_every)},
                                         {"fov_deg", fmt::format("{}", d.fov_deg)},
                                         {"target_fps", fmt::format("{}", d.target_fps)},
                                         {"update_rate", fmt::format("{}", r.max_rate_hz)},
                                         {"splat_scale", fmt::format("{}", scale)}};
  if (d.stereo.on()) {
    out["stereo"] = stereo::name_of(d.stereo.mode);
    out["eye_separation_m"] = fmt::format("{}", d.stereo.eye_separation_m);
  }
  add_trajectory(out, o);
  if (!o.poses.empty()) out["poses"] = o.poses;
  if (!o.service.link.empty()) out["link"] = o.service.link;
  if (const std::string device = renderers.device(); !device.empty()) out["gpu"] = device;
  ViewerOptions shown = o;
  out[metrics::kRecordFact] = "\n[display]\n" + options::recorded(view_table(shown), {});
  if (o.wall.empty()) return out;
  out["wall"] = o.wall;
  out["wall_tile"] = std::to_string(o.wall_tile);
  out["wall_scale"] = fmt::format("{}", o.wall_scale);
  return out;
}

// What all viewers of its wall call it.
std::string wall_name(const ViewerOptions& o) { return fmt::format("{} x{}", o.wall, o.wall_scale); }

// What keeps the display in step with a wall's others; null: it is by itself.
std::unique_ptr<WallPace> wall_pace(const ViewerOptions& o, net::Context& context, const ViewerWorker& worker) {
  if (!in_step(o)) return nullptr;
  const auto& d = o.display;
  return std::make_unique<WallPace>(
      context,
      WallPace::Options{.master = o.service.master,
                        .name = o.service.name,
                        .wall = wall_name(o),
                        .number = uint64_t(d.wall.tile),
                        .viewers = uint64_t(d.wall.tiles()),
                        .period_s = d.target_fps > 0 ? 1 / d.target_fps : 0,
                        .asks_hz = o.requests.max_rate_hz},
      [&worker] { return worker.instance(); }, [&worker](double s) { return worker.to_master_s(s); });
}

struct Served {
  DisplayResult display;
  bool session_ended = false;
  std::string why;      // it has ended, for people
  int link_code = 0;    // refused by the master, or it was waited for too long
  bool failed = false;  // nothing came any more
};

// Shows the session until it, the person or the clock ends it.
Served serve(const ViewerOptions& o, const net::Access& access, const Display& display, Renderers& renderers,
             SessionRecord& record) {
  net::Context context(access);
  CouplingGate gate(coupling_state(*coupling_named(o.coupling), o.buffers));
  metrics::TableRecorder frames("frames", frame_columns());
  metrics::SpanRecorder spans;
  RequestOptions requests = o.requests;
  if (in_step(o)) requests.wall = wall_name(o), requests.wall_viewers = uint64_t(o.display.wall.tiles());
  const ViewerWorker::Options options{.service = o.service,
                                      .requests = requests,
                                      .least_sampling = o.least_sampling,
                                      .facts = facts(o, renderers),
                                      .received = {.in_step = in_step(o)},
                                      .record = &record,
                                      .poses = display.poses,
                                      .started_s = o.started_s};
  ViewerWorker worker(context, options, gate, frames, spans);
  const SourceMaker make_source = [&](Received& r) { return r.make_source(o.display, renderers); };
  // Eyes never stand still, and each has half of the time.
  DisplayOptions eye = o.display;
  eye.still_samples = 1;
  const XrSourceMaker make_source_for_eyes = [&](Received& r, double pictures_s) {
    eye.target_fps = pictures_s;
    return r.make_source(eye, renderers);
  };
  Served served;
  const auto wall = wall_pace(o, context, worker);
  const std::function<FrameSpool*()> spool = [&] { return record.spool(); };
  if (display.headset)
    served.display = run_xr_display(o.display, o.xr_options, *display.headset, make_source_for_eyes, worker, frames,
                                    spans, spool, tell);
  else
    served.display =
        run_display(o.display, *display.surface, make_source, gate, worker, frames, spans, spool, wall.get());
  served.session_ended = worker.shutdown_requested();
  served.why = worker.shutdown_reason();
  served.link_code = worker.link_code();
  served.failed = worker.failed();
  return served;
}

// Recorded frames become pictures. After a signal there is a second for it; the rest stays where it is.
Status develop(const std::string& directory, FrameSpool& spool) {
  spool.flush();
  if (spool.dropped()) log::warn("{} frames to record were dropped: the disk did not keep up", spool.dropped());
  if (spool.failed()) log::warn("{} frames to record could not be written", spool.failed());
  // The launcher reads lines, a person one that is rewritten.
  const auto progress = [person = isatty(STDOUT_FILENO) != 0](size_t done, size_t of) {
    if (person)
      std::printf("\rpictures %.0f %%%s", 100.0 * double(done) / double(of), done == of ? "\n" : "");
    else
      std::printf("progress pictures %.3f\n", double(done) / double(of));
    std::fflush(stdout);
  };
  const auto in_time = [signalled_s = 0.0]() mutable {
    if (!net::stop_requested()) return true;
    if (signalled_s == 0) signalled_s = monotonic_s();
    return monotonic_s() - signalled_s < kPicturesAfterSignal_s;
  };
  if (const Status s = develop_frames(directory + "/spool", directory + "/images", progress, in_time); !s) return s;
  std::error_code error;
  if (std::filesystem::is_empty(directory + "/spool", error)) std::filesystem::remove(directory + "/spool", error);
  return ok_status();
}

// Ends the session for everyone, if that is this viewer's part. Exit code.
int farewell(const ViewerOptions& o, const net::Access& asking, const Served& served) {
  if (served.link_code != 0) return served.link_code;
  const int otherwise = served.failed ? 1 : 0;
  if (!o.end_session) return otherwise;
  if (!served.session_ended && !net::stop_requested())
    if (const auto answer =
            net::ask_master(o.service.master, "stop", kMasterPatience_s, {{"by", net::this_person()}}, asking);
        !answer)
      log::warn("the session could not be ended: {}", answer.error().text);
  if (served.display.frames == 0) log::error("the session ended before anything was shown");
  return served.display.frames == 0 ? 1 : otherwise;
}

}  // namespace

Result<int> run(ViewerOptions o) {
  const auto access = net::begin_service(o.service, {net::Role::kViewer, net::Role::kOperator});
  net::keep_freed_memory();
  if (const Status s = settle(o); !s) return s.error();
  if (!access) return access.error();
  // Whoever may change the session for everyone may do so at a window, too.
  const auto asking = net::access_of(o.service, net::asking_roles());
  if (!asking) return asking.error();
  const auto poses = open_poses(o);
  if (!poses) return poses.error();
  auto display = open_display(o, *asking, *poses);  // before the renderers, whose contexts may depend on the window's
  if (!display) return display.error();
  auto renderers = open_renderers(o);
  if (!renderers) return fail(renderers.error());
  auto record = open_record(o);
  if (!record) return record.error();

  const Served served = serve(o, *access, *display, *renderers, **record);
  if (!served.display.error.empty()) return fail({served.display.error});
  if (o.window && served.session_ended && !served.why.empty()) tell(served.why);
  const std::string lost = display->surface ? display->surface->failure() : "";
  display->surface.reset();  // the window goes at once, however much there is to write
  FrameSpool* const spool = (*record)->spool();
  const Status developed = spool ? develop((*record)->directory(), *spool) : ok_status();
  const int code = farewell(o, *asking, served);
  if (!lost.empty()) return fail({lost});
  if (!developed) log::error("{}", developed.error().text);
  const std::string failed = developed ? (*record)->failure() : developed.error().text;
  if (code == 0 && !failed.empty()) return not_recorded((*record)->directory(), failed);
  return code;
}

}  // namespace telesplat::viewer
