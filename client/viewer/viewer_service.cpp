#include "client/viewer/viewer_service.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "client/viewer/display/display_loop.h"
#include "client/viewer/display/headless_surface.h"
#include "client/viewer/session_record.h"
#include "common/core/clock.h"
#include "common/core/file_hash.h"
#include "common/core/log.h"
#include "common/core/machine.h"
#include "common/metrics/process.h"
#include "common/net/control.h"
#include "common/net/service_main.h"

namespace telesplat::viewer {
namespace {

constexpr double kPicturesAfterSignal_s = 1.0, kMasterPatience_s = 2.0;

int fail(const Error& error) {
  log::error("{}", error.text);
  return 1;
}

// Prints the failure for the launcher: it is no reason to end the session for others.
int not_recorded(const std::string& directory, const std::string& why) {
  const std::string text = fmt::format("{}: not all of the record could be written: {}", directory, why);
  if (!isatty(STDOUT_FILENO)) std::printf("record failed %s\n", text.c_str());
  std::fflush(stdout);
  return fail({text});
}

// Prints a line for the person: on a terminal as it is, else marked so that the launcher passes it on.
void tell(const std::string& text) {
  std::printf("%s%s\n", isatty(1) ? "" : "note ", text.c_str());
  std::fflush(stdout);
}

// Null: the options name no publisher of poses.
Result<std::shared_ptr<PoseFeed>> open_poses(const ViewerOptions& o) {
  if (o.head.poses.empty()) return std::shared_ptr<PoseFeed>();
  auto opened = PoseFeed::open({o.head.poses, o.requests.prediction, o.head.pose_horizon_s});
  if (!opened) return opened.error();
  return std::shared_ptr<PoseFeed>(std::move(*opened));
}

Result<std::unique_ptr<DisplaySurface>> open_surface(ViewerOptions& o, const Displays& displays,
                                                     const DisplayHelp& help) {
  if (o.xr.on) return displays.headset(o, help);
  if (o.window.shown) return displays.window(o, help);
  if (const std::string end = end_of_trajectory(o); !end.empty()) log::info("{}", end);
  auto made = std::make_unique<HeadlessSurface>(o.display, o.head.movement, tell);
  if (help.poses) made->follow(help.poses);
  return std::unique_ptr<DisplaySurface>(std::move(made));
}

Result<std::unique_ptr<SessionRecord>> open_record(const ViewerOptions& o) {
  RecordOptions options = o.record;
  options.name = o.service.name;
  return SessionRecord::open(options);
}

// Adds facts about the file that the head follows.
void add_trajectory(std::map<std::string, std::string>& facts, const ViewerOptions& o) {
  facts["trajectory"] = o.head.trajectory;
  if (!o.head.movement.recorded) return;
  std::error_code error;
  facts["trajectory_file"] = std::filesystem::absolute(o.head.trajectory, error).lexically_normal().string();
  if (const auto hash = hash_of_files({o.head.trajectory})) facts["trajectory_hash"] = hash_text(hash->hash);
}

// Returns the facts about this viewer for the master.
std::map<std::string, std::string> facts(const ViewerOptions& o, const Renderers& renderers) {
  const auto& d = o.display;
  const auto& r = o.requests;
  const double scale = o.drawing.splat_scale > 0 ? o.drawing.splat_scale : splat::suitable_scale(d.render.kernel);
  std::map<std::string, std::string> out{{"coupling", o.coupling.mode},
                                         {"buffers", std::to_string(r.buffers)},
                                         {"renderer", renderers.name()},
                                         {"splat", o.drawing.splat},
                                         {"finish", splat::finish_name(d.render.finish)},
                                         {"shading", o.drawing.shading},
                                         {"width", std::to_string(d.width)},
                                         {"height", std::to_string(d.height)},
                                         {"sampling_width", std::to_string(r.adaptive ? d.width : r.sampling_width)},
                                         {"sampling_height", std::to_string(r.adaptive ? d.height : r.sampling_height)},
                                         {"sampling", r.adaptive ? "adaptive" : "fixed"},
                                         {"duration_s", fmt::format("{}", d.span.duration_s)},
                                         {"frames", std::to_string(d.span.frames)},
                                         {"hold_s", fmt::format("{}", d.span.hold_s)},
                                         {"prediction", o.head.prediction},
                                         {"verify_every", std::to_string(d.kept.verify_every)},
                                         {"fov_deg", fmt::format("{}", d.fov_deg)},
                                         {"target_fps", fmt::format("{}", d.target_fps)},
                                         {"update_rate", fmt::format("{}", r.max_rate_hz)},
                                         {"splat_scale", fmt::format("{}", scale)}};
  if (d.stereo.on()) {
    out["stereo"] = stereo::name_of(d.stereo.mode);
    out["eye_separation_m"] = fmt::format("{}", d.stereo.eye_separation_m);
  }
  add_trajectory(out, o);
  if (!o.head.poses.empty()) out["poses"] = o.head.poses;
  if (!o.service.link.empty()) out["link"] = o.service.link;
  if (const std::string device = renderers.device(); !device.empty()) out["gpu"] = device;
  ViewerOptions shown = o;
  out[metrics::kRecordFact] = "\n[display]\n" + options::recorded(view_table(shown), {});
  if (o.wall.name.empty()) return out;
  out["wall"] = o.wall.name;
  out["wall_tile"] = std::to_string(o.wall.tile);
  out["wall_scale"] = fmt::format("{}", o.wall.scale);
  return out;
}

// Returns the pace that keeps the display in step with a wall's other displays; null: the display runs by itself.
std::unique_ptr<WallPace> wall_pace(const ViewerOptions& o, net::Context& context, const ViewerWorker& worker) {
  if (!in_step(o)) return nullptr;
  const auto& d = o.display;
  return std::make_unique<WallPace>(
      context,
      WallPace::Options{.master = o.service.master,
                        .name = o.service.name,
                        .wall = o.wall.shared_name(),
                        .number = uint64_t(d.wall.tile),
                        .viewers = uint64_t(d.wall.tiles()),
                        .period_s = d.target_fps > 0 ? 1 / d.target_fps : 0,
                        .asks_hz = o.requests.max_rate_hz},
      [&worker] { return worker.instance(); }, [&worker](double s) { return worker.to_master_s(s); });
}

struct Served {
  DisplayResult display;
  bool session_ended = false;
  std::string why;      // reason of the session's end, for people
  int link_code = 0;    // exit code if the master refused the link or did not answer in time; else 0
  bool failed = false;  // the worker's thread ended
};

// Shows the session until the session, the person or the clock ends it.
Served serve(const ViewerOptions& o, const net::Access& access, const std::shared_ptr<PoseFeed>& poses,
             DisplaySurface& surface, Renderers& renderers, SessionRecord& record) {
  net::Context context(access);
  CouplingGate gate(coupling_state(*coupling_named(o.coupling.mode), o.coupling.buffers));
  metrics::TableRecorder frames("frames", frame_columns());
  metrics::SpanRecorder spans;
  RequestOptions requests = o.requests;
  if (in_step(o)) requests.wall = o.wall.shared_name(), requests.wall_viewers = uint64_t(o.display.wall.tiles());
  const ViewerWorker::Options options{.service = o.service,
                                      .requests = requests,
                                      .least_sampling = o.least_sampling,
                                      .facts = facts(o, renderers),
                                      .received = {.in_step = in_step(o)},
                                      .record = &record,
                                      .poses = poses,
                                      .renderer = renderers.choice(),
                                      .started_s = o.started_s};
  ViewerWorker worker(context, options, gate, frames, spans);
  DisplayOptions paced = o.display;
  const SourceMaker make_source = [&](Received& r, double pictures_a_second) {
    if (pictures_a_second > 0) paced.target_fps = pictures_a_second;
    return r.make_source(paced, renderers);
  };
  Served served;
  const auto wall = wall_pace(o, context, worker);
  const std::function<FrameSpool*()> spool = [&] { return record.spool(); };
  served.display = run_display({o.display, surface, make_source, gate, worker, frames, spans, spool, wall.get()});
  served.session_ended = worker.shutdown_requested();
  served.why = worker.shutdown_reason();
  served.link_code = worker.link_code();
  served.failed = worker.failed();
  return served;
}

// Turns recorded frames into pictures. After a signal it stops within a second; the other frames stay where they are.
Status develop(const std::string& directory, FrameSpool& spool) {
  spool.flush();
  if (spool.dropped()) log::warn("{} frames to record were dropped: the disk did not keep up", spool.dropped());
  if (spool.failed()) log::warn("{} frames to record could not be written", spool.failed());
  // The launcher reads lines; a person sees one line that is rewritten.
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

// Ends the session for all if the flags say so. Returns the exit code.
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

Result<int> run(ViewerOptions o, const Displays& displays) {
  const auto access = net::begin_service(o.service, {net::Role::kViewer, net::Role::kOperator});
  net::keep_freed_memory();
  if (const Status s = settle(o); !s) return s.error();
  if (!access) return access.error();
  // A person who may change the session for all may do so at a window, too.
  const auto asking = net::access_of(o.service, net::asking_roles());
  if (!asking) return asking.error();
  const auto poses = open_poses(o);
  if (!poses) return poses.error();
  // The surface comes before the renderers, whose contexts may depend on the window's.
  auto surface = open_surface(o, displays, {*asking, *poses, tell});
  if (!surface) return surface.error();
  auto renderers = Renderers::make(o.drawing.renderer, o.drawing.threads);
  if (!renderers) return fail(renderers.error());
  auto record = open_record(o);
  if (!record) return record.error();

  const Served served = serve(o, *access, *poses, **surface, *renderers, **record);
  if (!served.display.error.empty()) return fail({served.display.error});
  if (o.window.shown && served.session_ended && !served.why.empty()) tell(served.why);
  const std::string lost = (*surface)->failure();
  surface->reset();  // the window goes at once, before the record is written
  FrameSpool* const spool = (*record)->spool();
  const Status developed = spool ? develop((*record)->directory(), *spool) : ok_status();
  const int code = farewell(o, *asking, served);
  if (!lost.empty()) return fail({lost});
  if (!developed) log::error("{}", developed.error().text);
  const std::string failed = developed ? (*record)->failure() : developed.error().text;
  if (code == 0 && !failed.empty()) return not_recorded((*record)->directory(), failed);
  return code;
}

Result<std::string> display_program() {
  std::error_code error;
  const auto here = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  const std::string path = here / kDisplayProgram;
  if (access(path.c_str(), X_OK) == 0) return path;
  return Error{fmt::format(
      "windows and headsets need {0}, which is not in {1}: cmake --build build/release --target {0} builds it",
      kDisplayProgram, here.string())};
}

int become_display_program(char** argv) {
  const auto path = display_program();
  if (path) execv(path->c_str(), argv);
  const std::string why = path ? *path + ": " + std::strerror(errno) : path.error().text;
  std::fprintf(stderr, "telesplat: %s\n", why.c_str());
  return 2;
}

int viewer_main(int argc, char** argv, const Displays& displays) {
  ViewerOptions options;
  options.service.name = net::unique_name("viewer");
  return net::service_main(
      argc, argv,
      "telesplat-viewer: caches points, splats them at display rate, headless or in a window, records frames", options,
      table, [&](ViewerOptions o) {
        const OpenDisplay& wanted = o.xr.on ? displays.headset : displays.window;
        return has_person(o) && !wanted ? Result<int>(become_display_program(argv)) : run(std::move(o), displays);
      });
}

}  // namespace telesplat::viewer
