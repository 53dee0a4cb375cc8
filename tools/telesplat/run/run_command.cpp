// `telesplat run SCENE`: the whole pipeline on this machine, headless and recorded. `telesplat view SCENE`: the same in
// a window.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>

#include "client/viewer/display/window.h"
#include "client/viewer/record/frame_spool.h"
#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/net/master_address.h"
#include "tools/common/complain.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/control/client.h"
#include "tools/telesplat/movie/movie.h"
#include "tools/telesplat/record/dated_folder.h"
#include "tools/telesplat/run/live_figures.h"
#include "tools/telesplat/run/pipeline.h"
#include "tools/telesplat/run/run_report.h"
#include "tools/telesplat/run/verify.h"
#include "tools/telesplat/run/wall.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

using State = Pipeline::State;

constexpr double kAskEvery_s = 0.5;  // the master for its status

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

/// A run from start to end. Exit codes: 0 done, 1 failed while running, 2 bad usage or input. No process is left behind
/// in any case.
class Run {
 public:
  /// movie: what is to be made of the record, if anything.
  Run(RunOptions options, std::shared_ptr<Scene> scene, std::optional<MoviePlan> movie)
      : o_(std::move(options)), scene_(std::move(scene)), movie_(std::move(movie)) {}

  int go() {
    if (const Status s = prepare(); !s) return tools::complain(s.error());
    auto pipeline = Pipeline::start(o_);
    if (!pipeline && o_.viewer.window && net::stop_requested()) return 0;
    if (!pipeline) return tools::complain(pipeline.error(), 1);
    progress_.line(fmt::format("session at {}; telesplat ctl status asks it", pipeline->master_endpoint()));
    State state = watch(*pipeline);
    pipeline->finish();
    keep_record(*pipeline, state);
    if (state == State::kBadInput || state == State::kFailed) return clear_up(state);
    if (o_.out.empty()) return 0;
    // A window that is closed, or Ctrl-C there, is an end like any other.
    const bool interrupted = state == State::kRunning && !o_.viewer.window;
    if (const Status s = verify(interrupted); !s) return tools::complain(s.error(), verify_code_);
    print_report(o_.out);
    if (const Status s = report_wall(); !s) return tools::complain(s.error(), 1);
    if (const int code = make_the_movie(interrupted); code != 0) return code;
    return interrupted ? 1 : 0;
  }

 private:
  Status prepare() {
    std::error_code error;
    folder_existed_ = o_.out.empty() || fs::exists(o_.out, error);
    if (!o_.out.empty()) return ok_status();
    const Status made = logs_.make();
    if (made) o_.log_directory = logs_.path();
    return made;
  }

  // Shows what goes on until the pipeline ends or somebody wants it to; kRunning: the latter.
  State watch(Pipeline& pipeline) {
    ControlClient control(pipeline.master_endpoint());
    SessionFigures figures;
    double asked_s = 0;
    std::string live;
    auto state = State::kRunning;
    while (state == State::kRunning && !net::stop_requested()) {
      std::vector<std::string> news;
      state = pipeline.supervise(news);
      for (const auto& n : news) progress_.line("telesplat: " + n);
      for (const auto& n : pipeline.take_notes()) progress_.line(n);
      if (monotonic_s() - asked_s > kAskEvery_s) {
        control.request_status();
        asked_s = monotonic_s();
      }
      if (const auto status = control.poll_status()) live = figures.update(*status, monotonic_s());
      if (o_.viewer.window && !live.empty())
        progress_.close();  // the window's title has the figures
      else if (!live.empty() || !pipeline.progress().empty())
        progress_.show(live.empty() ? pipeline.progress() : live);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    progress_.close();
    return state;
  }

  // What processes left half done: a viewer that is told to stop does so, whatever pictures are left to make.
  void keep_record(Pipeline& pipeline, State state) {
    if (state != State::kBadInput && !o_.out.empty()) develop_pictures();
    for (const auto& n : pipeline.take_notes()) progress_.line(n);
    if (!o_.join_master.empty() || o_.out.empty()) return;
    complete_session();
  }

  // Recorded frames become pictures, whatever made their viewer stop before they were.
  void develop_pictures() {
    std::error_code error;
    for (int i = 1; i <= o_.viewers; ++i) {
      const std::string folder = viewer_directory(o_.out, i), spool = folder + "/spool";
      if (!fs::is_directory(spool, error)) continue;
      const auto tell = [&](size_t done, size_t of) { progress_.show(fmt::format("picture {} of {}", done, of)); };
      if (const Status s = viewer::develop_frames(spool, folder + "/images", tell); !s)
        progress_.line("telesplat: " + s.error().text);
      if (fs::is_empty(spool, error)) fs::remove(spool, error);
      progress_.close();
    }
  }

  // Adds to the master's session.toml what only the launcher knows: the scene, and the display's camera. `telesplat
  // compare` renders a run's frames again with it.
  void complete_session() const {
    std::error_code error;
    const std::string path = o_.out + "/session.toml";
    if (!fs::exists(path, error)) return;
    const auto tables = scene_->session_tables();
    // If they cannot be made, its data server has said why.
    if (tables) std::ofstream(path, std::ios::app) << *tables << display_table(o_);
  }

  int clear_up(State state) {
    std::error_code error;
    if (state == State::kBadInput) {
      if (!folder_existed_) fs::remove_all(o_.out, error);
      return 2;
    }
    if (!logs_.path().empty()) tools::complain({"the logs are in " + logs_.path()});
    logs_.keep();
    return 1;
  }

  Status verify(bool interrupted) {
    if (o_.viewer.display.verify_every == 0 || interrupted || !o_.join_master.empty()) return ok_status();
    verify_code_ = 2;
    // The scene as it was opened, with what the record tells of its epochs: session.toml cannot tell every file's name.
    if (const Status s = scene_->read_record(o_.out); !s) return s;
    auto direct = scene_->open_direct(0, [](const char*, double) {});
    if (!direct) return direct.error();
    verify_code_ = 1;
    const auto tell = [&](size_t done, size_t of) { progress_.show(fmt::format("verifying view {} of {}", done, of)); };
    const auto& shading = o_.viewer.display.shading;
    const Status verified = verify_run(o_.out, **direct, shading, tell, net::stop_requested);
    progress_.close();
    return verified;
  }

  // The wall's picture, and the moments its tiles are of.
  Status report_wall() const {
    if (o_.viewer.wall.empty()) return ok_status();
    const auto tiles = stitch_wall(o_.out, *viewer::parse_wall(o_.viewer.wall));
    if (!tiles) return tiles.error();
    std::string moments;
    for (const auto& t : *tiles)
      moments += fmt::format("{}{} frame {} at {:.2f} s", moments.empty() ? "" : ", ", t.viewer, t.frame, t.t_s);
    std::printf("The wall's picture is images/wall.png, of %s\n", moments.c_str());
    return ok_status();
  }

  // Exit code. Whoever interrupts the run does not want to wait for a movie; Ctrl-C interrupts the movie, too.
  int make_the_movie(bool interrupted) {
    if (!movie_) return 0;
    const std::string& file = movie_->options.file;
    const std::string later =
        fmt::format("telesplat movie {} {} makes it of the record", shell_quoted(o_.out), shell_quoted(file));
    if (interrupted) {
      progress_.line(fmt::format("{} was not made; {}", file, later));
      return 0;
    }
    net::forget_stop();
    const auto report = make_movie(o_.out, *movie_, progress_, net::stop_requested);
    if (!report) return tools::complain(report.error(), 1);
    if (!report->written) return tools::complain(report->written.error(), 1);
    for (const auto& line : report->lines) std::printf("%s\n", line.c_str());
    if (report->interrupted) progress_.line(fmt::format("interrupted: {} was not made; {}", file, later));
    return report->interrupted ? kInterrupted : 0;
  }

  RunOptions o_;
  std::shared_ptr<Scene> scene_;
  std::optional<MoviePlan> movie_;
  bool folder_existed_ = false;
  int verify_code_ = 1;
  PassingFolder logs_;
  tools::ProgressLine progress_;
};

// Finds the session that --master auto means. Returns 0, or the exit code after saying why there is none.
int find_session(RunOptions& o) {
  if (o.join_master.empty()) return 0;
  const auto search = net::find_master(o.join_master);
  if (search.address.empty()) return tools::complain({search.problem}, search.exit_code());
  o.join_master = search.address;
  return 0;
}

int run(RunOptions o, const options::Given& given) {
  o.viewer.started_s = monotonic_s();
  if (o.out.empty() && !o.viewer.window) o.out = dated_folder();
  auto scene = settle(o, given);
  if (!scene) return tools::complain(scene.error());
  if (const int code = find_session(o)) return code;
  if (o.viewer.window)
    if (const Status s = viewer::check_display(); !s) return tools::complain(s.error());
  if (const std::string end = viewer::end_of_trajectory(o.viewer); !end.empty())
    std::fprintf(stderr, "%s\n", end.c_str());
  std::optional<MoviePlan> movie;
  if (!o.movie.file.empty()) {
    auto plan = plan_movie(o.movie, "--movie-size");
    if (!plan) return tools::complain(plan.error());
    movie = std::move(*plan);
  }
  net::install_signal_handlers();
  log::initialise("telesplat", "warn");
  return Run(std::move(o), std::move(*scene), std::move(movie)).go();
}

Command make(const char* name, const char* help, std::shared_ptr<RunOptions> defaults) {
  Command out = make_command(name, help, table, run, std::move(defaults));
  out.takes_scene_file = true;
  return out;
}

}  // namespace

Command run_command() {
  return make("run", "run the whole pipeline on this machine, headless, and record it", std::make_shared<RunOptions>());
}

Command view_command() {
  Command out = make("view", "open a window on a data set, with the whole pipeline on this machine",
                     std::make_shared<RunOptions>(view_defaults()));
  out.footer = "Keys and mouse in the window:";
  for (const auto& line : viewer::key_help()) out.footer += "\n  " + line;
  return out;
}

}  // namespace telesplat::launcher
