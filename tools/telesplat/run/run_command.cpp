// `telesplat run SCENE`: runs the whole pipeline on this machine, headless and recorded. `telesplat view SCENE`: the
// same in a window.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <thread>

#include "client/viewer/input/keys.h"
#include "client/viewer/recent_files.h"
#include "client/viewer/viewer_service.h"
#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/core/machine.h"
#include "common/metrics/run_folder.h"
#include "common/net/master_address.h"
#include "common/net/session_file.h"
#include "common/options/complain.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/control/client.h"
#include "tools/telesplat/run/after_run.h"
#include "tools/telesplat/run/joined/joined_session.h"
#include "tools/telesplat/run/live_figures.h"
#include "tools/telesplat/run/pipeline.h"
#include "tools/telesplat/run/run_keys.h"
#include "tools/telesplat/run/run_options.h"
#include "tools/telesplat/scene/scene_file.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

using State = Pipeline::State;

constexpr double kAskStatusEvery_s = 0.5;  // asks the master for its status this often
constexpr double kResultPatience_s = 2;

// Checks that the viewer could show its window here; if it could not, no process is started.
Status check_display(const RunOptions& o) {
  if (!viewer::has_person(o.viewer)) return ok_status();
  if (const auto program = viewer::display_program(); !program) return program.error();
  std::string why = o.viewer.xr.on ? "" : output_of(viewer::kDisplayProgram, "check");
  if (why.ends_with('\n')) why.pop_back();
  return why.empty() ? ok_status() : Status(Error{why});
}

// Returns flags for ctl if the session's file, which ctl looks for, is missing: the master's log says why.
std::string flags_of_ctl(const std::string& master, const std::string& keys) {
  for (const auto& session : net::running_sessions())
    if (session.address == net::local_address(master)) return "";
  return " --master " + master + (keys.empty() ? "" : " --keys " + keys);
}

/// A folder for the logs of a session without a record; the destructor deletes it unless something went wrong.
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

// Keeps the data set in the list of the open dialog. If the list cannot be written, the run goes on.
void keep_recent(const std::string& data_set) {
  if (const Status s = viewer::add_recent(viewer::recent_files_path(), data_set); !s) log::info("{}", s.error().text);
}

/// A run from start to end. Exit codes: 0 done, 1 failed while running, 2 bad usage or input, 130 interrupted. Never
/// leaves a process behind.
class Run {
 public:
  /// movie: the movie to make of the record, if any.
  Run(RunOptions options, std::shared_ptr<Scene> scene, std::optional<MoviePlan> movie)
      : o_(std::move(options)), scene_(std::move(scene)), movie_(std::move(movie)) {}

  int go() {
    if (const Status s = prepare(); !s) return complain(s.error());
    auto pipeline = Pipeline::start(o_);
    if (!pipeline) return not_started(pipeline.error());
    if (o_.join_master.empty())
      progress_.line(fmt::format("session at {}; telesplat ctl status{} shows it", pipeline->master_endpoint(),
                                 flags_of_ctl(pipeline->master_endpoint(), o_.keys)));
    const State state = watch(*pipeline);
    // From here on a signal is a new one: it ends the step that runs.
    const bool stopped = state == State::kRunning;
    if (stopped) net::forget_stop();
    pipeline->finish();
    record_failures_ = pipeline->record_failures();
    viewer_died_ = pipeline->viewer_died();
    if (!o_.join_master.empty()) ask_for_results(*pipeline);
    if (state != State::kBadInput && !o_.out.empty()) after_.develop_pictures();
    for (const auto& n : pipeline->take_notes()) progress_.line(n);
    if (state == State::kBadInput || state == State::kFailed) return clear_up(state);
    if (o_.out.empty()) return viewer_died_ ? 1 : 0;
    if (after_.displayed()) settle_replaced();
    if (stopped && net::stop_requested()) return end_at_once();
    if (!after_.displayed()) return record_failures_.empty() ? nothing_displayed(stopped) : tell_failures();
    return complete(stopped);
  }

 private:
  // From here on the folder is ours.
  Status prepare() {
    std::error_code error;
    if (o_.out.empty()) {
      const Status made = logs_.make();
      if (made) o_.log_directory = logs_.path();
      return made;
    }
    folder_existed_ = fs::exists(o_.out, error);
    if (o_.overwrite)
      if (const Status s = check_overwrite(o_); !s) return s;
    const auto begun = metrics::begin_folder(o_.out, o_.overwrite, metrics::Logs::kOurs);
    return begun ? ok_status() : Status(begun.error());
  }

  // Shows figures and news until the pipeline ends or a signal comes (kRunning).
  State watch(Pipeline& pipeline) {
    ControlClient control(pipeline.master_endpoint(), pipeline.access());
    SessionFigures figures;
    double asked_s = 0;
    std::optional<JoinedSession> joined;
    if (!o_.join_master.empty()) joined.emplace(o_.join_master, o_.data.scene);
    std::string live;
    auto state = State::kRunning;
    while (state == State::kRunning && !net::stop_requested()) {
      std::vector<std::string> news;
      state = pipeline.supervise(news);
      for (const auto& n : news) progress_.line("telesplat: " + n);
      for (const auto& n : pipeline.take_notes()) progress_.line(n);
      for (const auto& wish : pipeline.take_wishes()) open(pipeline, wish);
      if (monotonic_s() - asked_s > kAskStatusEvery_s) {
        control.request_status();
        if (const pid_t display = pipeline.display()) busy_.look(display, monotonic_s());
        asked_s = monotonic_s();
      }
      const auto status = control.poll_status();
      if (status) {
        if (o_.join_master.empty()) follow_orders(*status, pipeline, control);
        read_status(*status, figures, live);
      }
      if (joined)
        for (const auto& line :
             joined->look(status ? &*status : nullptr, control.nobody_there(), control.refusal(), monotonic_s()))
          progress_.line("telesplat: " + line);
      if (o_.viewer.window.shown && !o_.viewer.xr.on && !live.empty())
        progress_.close();  // the window's title has the figures
      else if (!live.empty() || !pipeline.progress().empty())
        progress_.show(live.empty() ? pipeline.progress() : live);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    progress_.close();
    return state;
  }

  // Opens the data set that a person chose in a window. A failure is shown there and here, and nothing else happens.
  void open(Pipeline& pipeline, const std::string& wish) {
    Status opened = try_open(pipeline, wish);
    if (opened) opened = open_due();
    if (!opened) tell_problem(pipeline, opened.error());
  }
  Status open_due() {
    const auto due = std::exchange(due_, nullptr);
    return due ? due() : ok_status();
  }
  void tell_problem(Pipeline& pipeline, const Error& error) {
    pipeline.tell_viewers("problem " + error.text);
    progress_.line("telesplat: " + error.text);
  }

  // Carries out orders of people to this process, which the master keeps (scene::Keeper::kLauncher).
  void follow_orders(const nlohmann::json& status, Pipeline& pipeline, ControlClient& control) {
    for (const Wish& wish : wishes_of(status)) {
      if (!obeyed_.emplace(wish.master, wish.number).second) continue;
      const auto done = obey(wish, pipeline);
      control.tell("done", {{"number", fmt::format("{}", wish.number)},
                            {"ok", done ? "true" : "false"},
                            {"text", done ? *done : done.error().text}});
      // First the answer, then the change: the old data server may take some seconds to end.
      if (const Status s = open_due(); !s) tell_problem(pipeline, s.error());
    }
  }

  Result<std::string> obey(const Wish& wish, Pipeline& pipeline) {
    if (wish.order == "samplers") {
      RunOptions wanted = o_;
      if (const Status s = options::set(*options::find(table(wanted), "--samplers"), wish.value); !s) return s.error();
      if (const Status s = pipeline.set_samplers(wanted.samplers); !s) return s.error();
      return fmt::format("{} sampler{}", wanted.samplers, wanted.samplers == 1 ? "" : "s");
    }
    const Status opened = wish.order == "open" ? try_open(pipeline, wish.value) : reopen(pipeline, wish);
    if (!opened) return opened.error();
    return wish.order == "open" ? "opening " + wish.value
                                : fmt::format("the data set is opened anew: {} {}", wish.order, wish.value);
  }

  // Reads the same data set again with another value of a flag.
  Status reopen(Pipeline& pipeline, const Wish& wish) {
    if (!o_.out.empty()) return Error{wish.order + ": a session that is recorded keeps its data set"};
    RunOptions other = o_;
    other.data = pipeline.data();
    const options::Table flags = data::scene_table(other.data);
    const auto* flag = options::find(flags, "--" + wish.order);
    if (!flag || other.data.scene.empty()) return Error{wish.order + ": no data set is shown"};
    const auto before = scene_of(other.data);
    if (!before) return before.error();
    if (const Status s = options::refuse_misfits(flags, {"--" + wish.order}, (*before)->kind(), other.data.scene); !s)
      return s;
    if (const Status s = options::set(*flag, wish.value); !s) return s;
    const auto scene = scene_of(other.data);
    if (!scene) return scene.error();
    if (const Status s = (*scene)->check(); !s) return s;
    due_ = [&pipeline, other] { return pipeline.open(other, true); };
    return ok_status();
  }

  Status try_open(Pipeline& pipeline, const std::string& wish) {
    if (!o_.out.empty())
      return Error{"a session that is recorded keeps its data set: without --out others can be opened"};
    RunOptions other = o_;
    other.data_servers = 1;
    other.data = {};
    other.data.scene = wish;
    const auto scene = scene_of(other.data);
    if (!scene) return scene.error();
    other.data.mesh.cache_dir = o_.data.mesh.cache_dir;
    other.data.mesh.use_cache = o_.data.mesh.use_cache;
    if (const Status s = (*scene)->check(); !s) return s;
    if (const Status s = check_pictures(other, scene->get()); !s) return s;
    keep_recent(wish);
    due_ = [&pipeline, other] { return pipeline.open(other); };
    return ok_status();
  }

  // A joined session is recorded by its master: takes the viewers' results from the status, once they have left. The
  // master may have another version: an answer in another form is not shown.
  void read_status(const nlohmann::json& status, SessionFigures& figures, std::string& live) try {
    live = figures.update(status, monotonic_s());
    if (const auto session = status.find("session"); session != status.end())
      master_folder_ = session->value("run_folder", std::string());
  } catch (const nlohmann::json::exception&) {
    live.clear();
  }

  void ask_for_results(Pipeline& pipeline) try {
    const auto status = ControlClient(pipeline.master_endpoint(), pipeline.access()).status(kResultPatience_s);
    if (status) results_ = viewer_results(*status, pipeline.viewers());
  } catch (const nlohmann::json::exception&) {
    results_.clear();
  }

  void remove_record() const {
    if (!o_.out.empty()) metrics::remove_record(o_.out, !folder_existed_);
  }

  // Deletes the record that --overwrite replaces, once the new one has frames. If the run failed, both its record and
  // the old one stay.
  void settle_replaced() const {
    if (!o_.overwrite || o_.out.empty()) return;
    std::error_code error;
    const std::string before = o_.out + "/.replaced";
    if (after_.displayed())
      metrics::forget_replaced(o_.out);
    else if (fs::exists(before, error))
      complain({"the record that was to be replaced is in " + before});
  }

  int not_started(const Error& error) {
    if (net::stop_requested()) return nothing_displayed(true);
    remove_record();
    return complain(error, 1);
  }

  int clear_up(State state) {
    if (state == State::kBadInput) {
      remove_record();
      return 2;
    }
    settle_replaced();
    if (!logs_.path().empty()) complain({"the logs are in " + logs_.path()});
    logs_.keep();
    return 1;
  }

  // A closed window, or Ctrl-C in it, is an ordinary end.
  int nothing_displayed(bool stopped) {
    remove_record();
    if (o_.viewer.window.shown) return 0;
    complain({stopped ? "interrupted before the first frame; nothing is recorded"
                      : "the session ended before the first frame; nothing is recorded"});
    return stopped ? kInterrupted : 1;
  }

  int tell_failures() const {
    for (const auto& failure : record_failures_) complain({failure});
    return 1;
  }

  int end_at_once() {
    after_.drop_spools();
    std::error_code error;
    const bool complete = !o_.join_master.empty() || fs::exists(o_.out + "/summary.json", error);
    complain({fmt::format("interrupted; the record in {} {}", o_.out,
                          complete ? "lacks what is made after the run" : "is not complete")});
    return o_.viewer.window.shown ? 0 : kInterrupted;
  }

  // True if the run ends by itself.
  bool has_end() const {
    const auto& d = o_.viewer.display;
    return !o_.viewer.window.shown && (d.span.duration_s > 0 || d.span.frames > 0);
  }

  int complete(bool stopped) {
    for (const auto& line : results_) std::printf("%s\n", line.c_str());
    const int code = after_.run(stopped, master_folder_);
    if (!net::stop_requested() || code == 0) after_.drop_spools();
    if (code != 0) return code;
    if (!record_failures_.empty()) return tell_failures();
    if (viewer_died_) return complain({"a viewer died before the end; the record has what it told"}, 1);
    if (busy_.share() > ProcessorWait::kMuch)
      progress_.line(
          fmt::format("telesplat: this machine was too busy: the display waited for a processor {:.0f} % of the time, "
                      "from which delays come, and leases that expire",
                      100 * busy_.share()));
    if (const int unseen = o_.viewer.window.shown ? 0 : after_.tell_unseen(stopped)) return unseen;
    const bool again = net::stop_requested();
    if (again)
      progress_.line("telesplat: interrupted; the record lacks what is made after the run");
    else if (stopped && !o_.viewer.window.shown)
      progress_.line(fmt::format("telesplat: {}; the record is complete", has_end() ? "interrupted" : "stopped"));
    return (again || stopped) && has_end() ? kInterrupted : 0;
  }

  RunOptions o_;
  std::shared_ptr<Scene> scene_;
  std::optional<MoviePlan> movie_;
  bool folder_existed_ = false, viewer_died_ = false;
  std::vector<std::string> record_failures_;
  ProcessorWait busy_;
  std::string master_folder_;                       // folder of the session's record; empty: unknown, or no record
  std::vector<std::string> results_;                // a line a viewer of a joined session
  std::function<Status()> due_;                     // opens the checked data set
  std::set<std::pair<uint64_t, uint64_t>> obeyed_;  // orders: master, number
  PassingFolder logs_;
  tools::ProgressLine progress_;
  AfterRun after_{o_, scene_.get(), movie_, progress_};  // last: it uses the others
};

// Finds the session of --master auto. Returns 0, or prints the problem and returns the exit code.
int find_session(RunOptions& o) {
  if (o.join_master.empty()) return 0;
  const auto search = net::find_master(o.join_master);
  if (search.address.empty()) return complain({search.problem}, search.exit_code());
  o.join_master = search.address;
  if (o.keys.empty() || o.keys == kKeysAuto) o.keys = search.keys;
  return 0;
}

int run(RunOptions o, const options::Given& given) {
  o.viewer.started_s = monotonic_s();
  setenv(kLaunchedByVariable, command_line().c_str(), 1);
  if (o.out.empty() && !o.viewer.window.shown) o.out = dated_folder();
  auto scene = settle(o, given);
  if (!scene) return complain(scene.error());
  if (const int code = find_session(o)) return code;
  const auto passing_keys = settle_keys(o);
  if (!passing_keys) return complain(passing_keys.error());
  if (const Status s = check_display(o); !s) return complain(s.error());
  if (const std::string end = viewer::end_of_trajectory(o.viewer); !end.empty())
    std::fprintf(stderr, "%s\n", end.c_str());
  std::optional<MoviePlan> movie;
  if (!o.movie.file.empty()) {
    auto plan = plan_movie(o.movie, "--movie-size");
    if (!plan) return complain(plan.error());
    movie = std::move(*plan);
  }
  net::install_signal_handlers();
  log::initialise("telesplat", "warn");
  if (o.viewer.window.shown && !o.data.scene.empty()) keep_recent(o.data.scene);
  return Run(std::move(o), std::move(*scene), std::move(movie)).go();
}

Command make(const char* name, const char* help, std::shared_ptr<RunOptions> defaults) {
  Command out = make_command(name, help, table, run, std::move(defaults));
  out.expand = expand_scene_file;
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
