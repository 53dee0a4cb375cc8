#include "tools/telesplat/run/run_command.h"

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
#include "tools/telesplat/control/client.h"
#include "tools/telesplat/progress_line.h"
#include "tools/telesplat/run/pipeline.h"
#include "tools/telesplat/run/run_report.h"
#include "tools/telesplat/run/verify.h"
#include "tools/telesplat/run/wall.h"
#include "tools/telesplat/scene/recorded_julia.h"
#include "tools/telesplat/scene/recorded_volume.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

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
  } else if (o.kind == SceneKind::kVolume && o.join_master.empty()) {
    if (const auto found = data::find_volume(o.scene, o.volume.raw); !found) return found.error();
  }
  if (!o.wall.empty() && o.viewers != parse_wall(o.wall)->tiles())
    return Error{fmt::format("--viewers {}: a wall of {} has {}", o.viewers, o.wall, parse_wall(o.wall)->tiles())};
  if (const auto size = viewer::parse_size(o.viewer.size, "--size"); !size) return size.error();
  if (const auto size = viewer::parse_sampling_size(o.viewer.sampling_size); !size) return size.error();
  if (o.viewer.trajectory != "orbit" && o.viewer.trajectory != "still")
    if (const auto t = geometry::Trajectory::read_csv(o.viewer.trajectory); !t) return t.error();
  return o.viewer.window ? viewer::check_display() : ok_status();
}

// The wall's picture, and of which moments its tiles are.
Status report_wall(const RunOptions& o) {
  const auto tiles = stitch_wall(o.out, *parse_wall(o.wall));
  if (!tiles) return tiles.error();
  std::string moments;
  for (const auto& t : *tiles)
    moments += fmt::format("{}{} frame {} at {:.2f} s", moments.empty() ? "" : ", ", t.viewer, t.frame, t.t_s);
  std::printf("The wall's picture is images/wall.png, of %s\n", moments.c_str());
  return ok_status();
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
    if (o.kind == SceneKind::kVolume) {
      out << "kind = \"volume\"\n" << (o.volume.lit ? "" : "lighting = \"off\"\n");
      if (!o.volume.raw.empty()) out << "raw = " << quoted(o.volume.raw) << "\n";
      if (!o.volume.transfer.empty()) out << "tf = " << quoted(o.volume.transfer) << "\n";
    }
    if (o.kind == SceneKind::kMesh) {
      if (o.mesh.iso) out << fmt::format("iso = {}\n", *o.mesh.iso);
      if (!o.mesh.raw.empty()) out << "raw = " << quoted(o.mesh.raw) << "\n";
      if (o.mesh.elevation.z_scale != 0) out << fmt::format("z_scale = {}\n", o.mesh.elevation.z_scale);
      if (const auto& texture = o.mesh.elevation.texture; !texture.empty())
        out << "texture = " << quoted(fs::absolute(texture, error).string()) << "\n";
    }
    if (!o.mesh.use_cache) out << "no_cache = true\n";
    if (!o.mesh.cache_dir.empty()) out << "cache = " << quoted(fs::absolute(o.mesh.cache_dir, error).string()) << "\n";
  }
  const auto& d = o.viewer.display;
  out << fmt::format("\n[display]\nsize = \"{}\"\nfov = {}\nnear = {}\nshading = \"{}\"\n", o.viewer.size, d.fov_deg,
                     d.near_m, o.viewer.shading);
}

// The scene that a run showed, for its reference pictures.
Result<std::unique_ptr<DirectScene>> open_direct(const RunOptions& o) {
  const auto silent = [](const char*, double) {};
  if (o.kind == SceneKind::kVolume) {
    auto volume = read_recorded_volume(o.out);
    if (!volume) return volume.error();
    return open_direct_volume(std::move(*volume), 0, silent);
  }
  if (!o.shows_julia()) return open_direct_mesh(o.scene, o.mesh, 0, silent);
  auto julia = read_recorded_julia(o.out);
  if (!julia) return julia.error();
  return open_direct_julia(std::move(*julia), 0);
}

// Recorded frames become pictures, whatever made their viewer stop before they were.
void develop_pictures(const RunOptions& o, ProgressLine& progress) {
  std::error_code error;
  for (int i = 1; i <= o.viewers; ++i) {
    const std::string folder = viewer_directory(o.out, i), spool = folder + "/spool";
    if (!fs::is_directory(spool, error)) continue;
    const auto tell = [&](size_t done, size_t of) { progress.show(fmt::format("picture {} of {}", done, of)); };
    if (const Status s = viewer::develop_frames(spool, folder + "/images", tell); !s)
      progress.line("telesplat: " + s.error().text);
    if (fs::is_empty(spool, error)) fs::remove(spool, error);
    progress.close();
  }
}

void add_volume_flags(CLI::App& app, RunOptions& o) {
  app.add_option("--raw", o.volume.raw,
                 "a raw volume's layout: SIZExSIZExSIZE:u8|i8|u16|i16|f32[:SPACING,SPACING,SPACING]");
  app.add_option("--tf", o.volume.transfer,
                 "a volume's transfer function: a preset (telesplat presets), a ParaView JSON file, or "
                 "value:colour:opacity,...; default: what fits");
  app.add_option("--iso", o.mesh.iso, "show the surface where a volume has this value, as a mesh");
  app.add_option("--z-scale", o.mesh.elevation.z_scale,
                 "elevation rasters: heights are so many times as high; 0: as they are, or what suits a raster without "
                 "coordinates")
      ->capture_default_str();
  app.add_option("--texture", o.mesh.elevation.texture, "elevation rasters: picture that is laid over them");
  app.add_option_function<std::string>(
         "--lighting", [&o](const std::string& v) { o.volume.lit = v == "on"; },
         "on: a volume's voxels are shaded by their gradients")
      ->default_str("on")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--series-rate", o.series_rate,
                 "steps a second at which a numbered series of volumes plays; 0: it does not; default: all in a second")
      ->check(CLI::Range(0.0, 1000.0));
  app.add_option("--data-servers", o.data_servers, "processes that each serve a part of a volume")
      ->capture_default_str()
      ->check(CLI::Range(1, 16));
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
  app.add_option(
      "scene", o.scene,
      "mesh file (PLY, OBJ, STL, OFF, VTP, VTK, glTF, GLB), volume (NRRD, MetaImage, NIfTI, VTI, raw, a folder of "
      "DICOM slices or of a numbered series), the word julia, or a scene file (TOML)");
  const bool window = o.viewer.window;
  app.add_option("--out", o.out,
                 window ? "run folder; without it nothing is recorded" : "run folder; default: runs/DATE-TIME");
  if (!window) {
    app.add_option("--viewers", o.viewers, "viewers, each of which follows the trajectory; the first one is verified")
        ->capture_default_str()
        ->check(CLI::Range(1, kMaxViewers));
    app.add_option(
        "--wall", o.wall,
        "COLUMNSxROWS: a display wall of so many viewers, each with --size pixels of one picture of --fov; its "
        "picture at the end becomes images/wall.png");
  }
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
  add_volume_flags(app, o);
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

int run(const CLI::App& flags, RunOptions o) {
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
  if (o.scene.empty() && o.join_master.empty())
    return refuse({"a scene is needed: a mesh or volume file, a folder of DICOM slices, or the word julia"});
  if (const Status s = settle_scene(flags, o); !s) return refuse(s.error());
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
  if (state != Pipeline::State::kBadInput && !o.out.empty()) develop_pictures(o, progress);
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
  if (!o.wall.empty())
    if (const Status s = report_wall(o); !s) {
      std::fprintf(stderr, "telesplat: %s\n", s.error().text.c_str());
      return 1;
    }
  return interrupted && !window ? 1 : 0;
}

}  // namespace telesplat::launcher
