#include "tools/telesplat/run_command.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <thread>

#include "client/viewer/display/window.h"
#include "client/viewer/record/frame_spool.h"
#include "common/core/clock.h"
#include "tools/telesplat/control_client.h"
#include "tools/telesplat/pipeline.h"
#include "tools/telesplat/progress_line.h"
#include "tools/telesplat/recorded_julia.h"
#include "tools/telesplat/verify.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

// A frame of a Julia set is dear: coarser while the head moves. Points of views long past are of no use, since nothing is eliminated.
constexpr double kJuliaLeastSampling = 0.4, kJuliaMaxPoints = 8e6;

// fps, updates/s, points, MB/s from two status answers.
class LiveFigures {
 public:
  std::string update(const nlohmann::json& status, double now_s) {
    double updates = 0, points = 0, bytes = 0, frames = 0;
    int samplers = 0;
    for (const auto& p : status["processes"]) {
      const auto value = [&](const char* key) {
        return p.contains("values") && p["values"].contains(key) ? p["values"][key].get<double>() : 0.0;
      };
      if (p["role"] == "sampler" && p["alive"] == true) ++samplers;
      if (p["role"] != "viewer") continue;
      updates += value("updates");
      frames += value("frames");
      points += value("points");
      bytes += value("bytes_received");
    }
    const double dt = now_s - last_s_;
    if (last_s_ > 0 && dt > 0.5 && frames > 0)
      text_ = fmt::format("{:5.1f} fps  {:4.1f} updates/s  {:5.2f} M points  {:5.2f} MB/s  {} sampler{}",
                          (frames - frames_) / dt, (updates - updates_) / dt, points / 1e6, (bytes - bytes_) / 1e6 / dt,
                          samplers, samplers == 1 ? "" : "s");
    if (dt > 0.5) last_s_ = now_s, updates_ = updates, bytes_ = bytes, frames_ = frames;
    return text_;
  }

 private:
  double last_s_ = 0, updates_ = 0, bytes_ = 0, frames_ = 0;
  std::string text_;
};

/// A folder for the logs of a session that leaves nothing behind; kept if something went wrong.
class PassingFolder {
 public:
  Status make() {
    std::error_code error;
    std::string pattern = (fs::temp_directory_path(error) / "telesplat-view-XXXXXX").string();
    if (error || !mkdtemp(pattern.data())) return Error{fmt::format("{}: no folder for logs can be made", pattern)};
    path_ = pattern;
    return ok_status();
  }
  ~PassingFolder() {
    std::error_code error;
    if (!path_.empty()) fs::remove_all(path_, error);
  }
  const std::string& path() const { return path_; }
  void keep() { path_.clear(); }

 private:
  std::string path_;
};

std::string default_out() {
  char name[64];
  const std::time_t now = std::time(nullptr);
  std::strftime(name, sizeof name, "runs/%Y%m%d-%H%M%S", std::localtime(&now));
  return name;
}

Status check_usage(const RunOptions& o) {
  if (o.viewer.window && o.out.empty())
    for (const auto& [asked, flag] : {std::pair{o.viewer.display.verify_every > 0, "--verify"},
                                      {o.viewer.display.picture_every > 0, "--record-every"},
                                      {o.viewer.display.exr, "--exr"},
                                      {o.record_depth, "--record-depth"}})
      if (asked) return Error{fmt::format("{} needs --out: nothing is recorded without a run folder", flag)};
  if (o.shows_julia()) {
    if (const auto scene = julia::read_scene(o.julia); !scene) return scene.error();
  } else if (o.julia.any() && o.scene.empty()) {
    return Error{
        "a Julia set's parameters are given, but no scene; a running session's are changed with telesplat ctl set"};
  } else if (o.julia.any()) {
    return Error{fmt::format("{}: is not \"{}\", but a Julia set's parameters are given", o.scene, julia::kSceneWord)};
  } else if (o.join_master.empty()) {
    std::error_code error;
    if (!fs::exists(o.scene, error)) return Error{fmt::format("{}: no such file", o.scene)};
    if (fs::is_directory(o.scene, error))
      return Error{fmt::format("{}: is a folder; a mesh file is needed, or the word julia", o.scene)};
  }
  if (const auto size = viewer::parse_size(o.viewer.size, "--size"); !size) return size.error();
  if (const auto size = viewer::parse_sampling_size(o.viewer.sampling_size); !size) return size.error();
  if (o.viewer.trajectory != "orbit" && o.viewer.trajectory != "still")
    if (const auto t = geometry::Trajectory::read_csv(o.viewer.trajectory); !t) return t.error();
  return o.viewer.window ? viewer::check_display() : ok_status();
}

// Adds to the master's session.toml what only the launcher knows: where the scene is, and the display's camera. `telesplat compare`
// renders a run's frames again with it.
void complete_session(const RunOptions& o) {
  std::error_code error;
  const std::string path = o.out + "/session.toml";
  if (!fs::exists(path, error)) return;
  const auto quoted = [](const std::string& text) {
    std::string out = "\"";
    for (const char c : text) {
      if (c == '"' || c == '\\') out += '\\';
      out += static_cast<unsigned char>(c) < 32 ? ' ' : c;
    }
    return out + '"';
  };
  std::ofstream out(path, std::ios::app);
  if (o.shows_julia()) {
    const auto scene = julia::read_scene(o.julia);
    if (!scene) return;
    const auto placement = julia::place(*scene, o.mesh.room_size_m);
    if (!placement) return;
    out << session_tables(*scene, *placement, o.mesh.room_size_m);
  } else {
    out << "\n[scene]\nfile = " << quoted(fs::absolute(o.scene, error).string())
        << fmt::format("\nroom_size = {}\nup = \"{}\"\n", o.mesh.room_size_m, o.mesh.up);
    if (!o.mesh.use_cache) out << "no_cache = true\n";
    if (!o.mesh.cache_dir.empty()) out << "cache = " << quoted(fs::absolute(o.mesh.cache_dir, error).string()) << "\n";
  }
  const auto& d = o.viewer.display;
  out << fmt::format("\n[display]\nsize = \"{}\"\nfov = {}\nnear = {}\nshading = \"{}\"\n", o.viewer.size, d.fov_deg,
                     d.near_m, o.viewer.shading);
}

// The scene that a run showed, for its reference pictures.
Result<std::unique_ptr<DirectScene>> open_direct(const RunOptions& o) {
  if (!o.shows_julia()) return open_direct_mesh(o.scene, o.mesh, 0, [](const char*, double) {});
  auto julia = read_recorded_julia(o.out);
  if (!julia) return julia.error();
  return open_direct_julia(std::move(*julia), 0);
}

void print_report(const std::string& directory) {
  std::ifstream in(directory + "/summary.json");
  const auto s = nlohmann::json::parse(in, nullptr, false);
  if (!s.is_object()) return;
  const auto line = [](const std::string& what, const std::string& value) {
    std::printf("  %-34s %s\n", what.c_str(), value.c_str());
  };
  const auto dist = [&](const char* key, const char* unit) {
    const auto& d = s[key];
    return fmt::format("median {:.1f}  p95 {:.1f}  max {:.1f} {}", d["median"].get<double>(), d["p95"].get<double>(),
                       d["max"].get<double>(), unit);
  };
  std::string subject = s["scene"].get<std::string>();
  if (s["kind"] == "mesh") {
    subject += fmt::format(": {} triangles", s["primitives"].get<uint64_t>());
  } else if (const auto julia = read_recorded_julia(directory)) {
    const auto& c = julia->begin.c;
    subject += fmt::format(": c = ({:.4g}, {:.4g}, {:.4g}, {:.4g}), {} epoch(s)", c.x, c.y, c.z, c.w,
                           std::max<size_t>(1, julia->epochs.size()));
  }
  std::printf("\n%s, display %dx%d, sampling %dx%d, %d sampler(s), %s renderer, %s splats\n", subject.c_str(),
              s["size"][0].get<int>(), s["size"][1].get<int>(), s["sampling_size"][0].get<int>(),
              s["sampling_size"][1].get<int>(), s["samplers"].get<int>(), s["renderer"].get<std::string>().c_str(),
              s["splat"].get<std::string>().c_str());
  line("display", fmt::format("{:.1f} fps over {} frames", s["fps"].get<double>(), s["frames"].get<uint64_t>()));
  line("inter-frame delay", dist("inter_frame_delay_ms", "ms"));
  line("view construction", dist("view_construction_ms", "ms"));
  line("view updates",
       fmt::format("{:.2f} per second, {} in all", s["updates_per_s"].get<double>(), s["updates"].get<uint64_t>()));
  line("view update latency", dist("view_update_latency_ms", "ms"));
  line("sampling / packing of a frame",
       fmt::format("median {:.1f} / {:.1f} ms", s["sampling_ms"]["median"].get<double>(),
                   s["packing_ms"]["median"].get<double>()));
  line("points cached", fmt::format("{:.2f} M, {:.1f} bytes each", s["points_cached"].get<double>() / 1e6,
                                    s["bytes_per_cached_point"].get<double>()));
  line("redundancy eliminated", fmt::format("{:.2f} %", s["redundancy_eliminated"].get<double>() * 100));
  line("sent to viewers",
       fmt::format("{:.2f} MB of {:.0f} MB sampled ({:.0f} : 1), {:.2f} MB/s", s["bytes_sent"].get<double>() / 1e6,
                   s["bytes_raw"].get<double>() / 1e6, s["compression_ratio"].get<double>(),
                   s["data_transfer_rate_mb_s"].get<double>()));
  if (s["quality"].is_object()) {
    const auto& q = s["quality"];
    line("PSNR against direct rendering",
         fmt::format("median {:.2f} dB over {} views", q["psnr_db"]["median"].get<double>(), q["views"].get<int>()));
    line("SSIM", fmt::format("median {:.4f}", q["ssim"]["median"].get<double>()));
    line("hole fraction", fmt::format("median {:.3f} %  p95 {:.3f} %", q["hole_fraction"]["median"].get<double>() * 100,
                                      q["hole_fraction"]["p95"].get<double>() * 100));
    if (q.contains("last_view"))
      line("last view", fmt::format("PSNR {:.2f} dB, holes {:.3f} %", q["last_view"]["psnr_db"].get<double>(),
                                    q["last_view"]["hole_fraction"].get<double>() * 100));
  }
  const auto& e = s["errors"];
  line("errors", fmt::format("{} messages rejected, {} gaps resynchronised, {} leases expired",
                             e["messages_rejected"].get<uint64_t>(), e["gaps_resynced"].get<uint64_t>(),
                             e["leases_expired"].get<uint64_t>()));
  std::printf("\nEverything lies in %s (summary.json, frames.csv, updates.csv, tiles.csv, trace.json, images/)\n",
              directory.c_str());
}

}  // namespace

RunOptions view_defaults() {
  RunOptions o;
  o.viewer.window = true;
  o.viewer.trajectory = "still";
  o.viewer.display.duration_s = 0;
  return o;
}

void add_run_flags(CLI::App& app, RunOptions& o) {
  app.add_option("scene", o.scene,
                 "mesh file (PLY, OBJ, STL, OFF, VTP, VTK, glTF, GLB), the word julia, or a scene file (TOML)");
  const bool window = o.viewer.window;
  app.add_option("--out", o.out,
                 window ? "run folder; without it nothing is recorded" : "run folder; default: runs/DATE-TIME");
  if (window) app.add_flag("--fullscreen", o.viewer.fullscreen, "the window fills the screen");
  app.add_option("--samplers", o.samplers, "sampler processes")->capture_default_str()->check(CLI::Range(1, 64));
  app.add_option("--sampler", o.sampler_kind, "ray (Embree), raster (OpenGL), or auto: raster on a GPU, else ray")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "ray", "raster"}));
  app.add_option("--sampler-threads", o.sampler_threads, "threads of each sampler; 0: the cores shared among them")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  app.add_option("--master", o.join_master, "join the running session at this address instead of starting one");
  app.add_option("--room-size", o.mesh.room_size_m, "largest extent of the data set in room space, metres")
      ->capture_default_str()
      ->check(CLI::Range(1e-3, 1e3));
  app.add_option("--up", o.mesh.up, "data axis that points up")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "x", "y", "z", "-x", "-y", "-z"}));
  app.add_option("--cache", o.mesh.cache_dir,
                 "folder of the chunk store; default: telesplat in the user's cache folder");
  app.add_flag("!--no-cache", o.mesh.use_cache, "keep no chunk store");
  app.add_flag("!--same-priority", o.background_servers, "run samplers, packer and data at the viewer's priority");
  app.add_flag("--record-depth", o.record_depth,
               "keep the first 50 sampled depth images (telesplat inspect reads them)");
  app.add_option("--seed", o.seed, "seed of whatever is random in a run; nothing is, in mesh runs")
      ->capture_default_str();
  julia::add_scene_flags(app, o.julia);
  viewer::add_view_flags(app, o.viewer);
  master::add_session_flags(app, o.master);
  app.add_option("--log-level", o.master.service.log_level, "trace, debug, info, warn, error or off")
      ->capture_default_str()
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}));
  if (!window) return;
  std::string keys = "Keys and mouse in the window:";
  for (const auto& line : viewer::key_help()) keys += "\n  " + line;
  app.footer(keys);
}

void apply_scene_defaults(const CLI::App& app, RunOptions& o) {
  if (!o.shows_julia()) return;
  if (app.count("--least-sampling") == 0) o.viewer.requests.min_scale = kJuliaLeastSampling;
  if (app.count("--packing.max_points") == 0) o.master.master.settings["packing.max_points"] = kJuliaMaxPoints;
}

int run(const RunOptions& given) {
  RunOptions o = given;
  o.started_s = monotonic_s();
  const bool window = o.viewer.window;
  if (o.out.empty() && !window) o.out = default_out();
  const auto refuse = [](const Error& e) {
    std::fprintf(stderr, "telesplat: %s\n", e.text.c_str());
    return 2;
  };
  if (o.julia.list_presets) {
    std::fputs(julia::describe_presets().c_str(), stdout);
    return 0;
  }
  if (o.scene.empty() && o.join_master.empty()) return refuse({"a scene is needed: a mesh file or the word julia"});
  if (const Status s = check_usage(o); !s) return refuse(s.error());
  net::install_signal_handlers();
  log::initialise("telesplat", "warn");

  std::error_code error;
  const bool folder_existed = o.out.empty() || fs::exists(o.out, error);
  PassingFolder logs;
  if (o.out.empty()) {
    if (const Status s = logs.make(); !s) return refuse(s.error());
    o.log_directory = logs.path();
  }
  auto pipeline = Pipeline::start(o);
  if (!pipeline) {
    std::fprintf(stderr, "telesplat: %s\n", pipeline.error().text.c_str());
    return 1;
  }
  ProgressLine progress;
  auto state = Pipeline::State::kRunning;
  {
    ControlClient control(pipeline->master_endpoint());
    LiveFigures figures;
    double asked_s = 0;
    std::string live;
    while (state == Pipeline::State::kRunning && !net::stop_requested()) {
      std::vector<std::string> news;
      state = pipeline->supervise(news);
      for (const auto& n : news) progress.line("telesplat: " + n);
      for (const auto& n : pipeline->take_notes()) progress.line(n);
      if (monotonic_s() - asked_s > 0.5) {
        control.request_status();
        asked_s = monotonic_s();
      }
      if (const auto status = control.poll_status()) live = figures.update(*status, monotonic_s());
      if (window && !live.empty())
        progress.close();  // the window's title has the figures
      else if (!live.empty() || !pipeline->progress().empty())
        progress.show(live.empty() ? pipeline->progress() : live);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
  progress.close();
  pipeline->finish();
  // A viewer that is told to stop does so, whatever pictures are left to make.
  const std::string spool = o.out + "/spool";
  if (state != Pipeline::State::kBadInput && !o.out.empty() && fs::is_directory(spool, error)) {
    const auto tell = [&](size_t done, size_t of) { progress.show(fmt::format("picture {} of {}", done, of)); };
    if (const Status s = viewer::develop_frames(spool, o.out + "/images", tell); !s)
      progress.line("telesplat: " + s.error().text);
    if (fs::is_empty(spool, error)) fs::remove(spool, error);
    progress.close();
  }
  for (const auto& n : pipeline->take_notes()) progress.line(n);
  if (o.join_master.empty() && !o.out.empty()) complete_session(o);
  if (state == Pipeline::State::kBadInput) {
    if (!folder_existed) fs::remove_all(o.out, error);
    return 2;
  }
  if (state == Pipeline::State::kFailed) {
    if (!logs.path().empty()) std::fprintf(stderr, "telesplat: the logs are in %s\n", logs.path().c_str());
    logs.keep();
    return 1;
  }
  if (o.out.empty()) return 0;

  const bool interrupted = state == Pipeline::State::kRunning;
  if (o.viewer.display.verify_every && (window || !interrupted) && o.join_master.empty()) {
    auto scene = open_direct(o);
    if (!scene) return refuse(scene.error());
    const Status verified = verify_run(
        o.out, **scene, *image::shading_named(o.viewer.shading),
        [&](size_t done, size_t of) { progress.show(fmt::format("verifying view {} of {}", done, of)); },
        net::stop_requested);
    progress.close();
    if (!verified) {
      std::fprintf(stderr, "telesplat: %s\n", verified.error().text.c_str());
      return 1;
    }
  }
  print_report(o.out);
  return interrupted && !window ? 1 : 0;
}

}  // namespace telesplat::launcher
