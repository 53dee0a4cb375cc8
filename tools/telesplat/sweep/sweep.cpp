#include "tools/telesplat/sweep/sweep.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "common/core/clock.h"
#include "common/core/utf8.h"
#include "common/metrics/statistics.h"
#include "common/net/service.h"
#include "common/options/parser.h"
#include "tools/telesplat/run/child_process.h"
#include "tools/telesplat/run/run_options.h"
#include "tools/telesplat/scene/scene_file.h"
#include "tools/telesplat/sweep/record.h"

namespace telesplat::launcher {
namespace {

constexpr double kLook_s = 0.05;
constexpr double kEndPatience_s = 30;  // for a run to end, after its time limit
constexpr size_t kLongestReason = 300;

std::string reason_for(int exit_code, const std::string& said) {
  const std::string why = complaint_in(said);
  const std::string how =
      exit_code > 128 ? fmt::format("ended by signal {}", exit_code - 128) : fmt::format("exit code {}", exit_code);
  return why.empty() ? how : how + ": " + why;
}

/// Waits for the child, and passes signals on to it.
class Watch {
 public:
  Watch(ChildProcess& child, double limit_s) : child_(child), limit_s_(limit_s) {}

  void until_ended(const std::function<void(double)>& watch) {
    while (!child_.ended()) {
      child_.read_lines();  // a full pipe would stop it
      const double elapsed_s = monotonic_s() - begin_s_;
      if (net::stop_requested()) pass_on();
      if (limit_s_ > 0 && elapsed_s > limit_s_) end_late(elapsed_s);
      watch(elapsed_s);
      std::this_thread::sleep_for(std::chrono::duration<double>(kLook_s));
    }
  }
  bool stopped() const { return stops_ > 0; }
  bool late() const { return late_; }
  double elapsed_s() const { return monotonic_s() - begin_s_; }

 private:
  void pass_on() {
    net::forget_stop();
    child_.signal(++stops_ < 3 ? SIGINT : SIGKILL);
  }
  void end_late(double elapsed_s) {
    if (!late_) child_.signal(SIGINT);
    if (elapsed_s > limit_s_ + kEndPatience_s) child_.signal(SIGKILL);
    late_ = true;
  }

  ChildProcess& child_;
  double limit_s_, begin_s_ = monotonic_s();
  int stops_ = 0;
  bool late_ = false;
};

struct Refused {
  const char* flag;
  const char* why;
};
constexpr Refused kRefused[] = {
    {"--out", "the sweep gives each run a folder of its own"},
    {"--label", "its runs are called by what varies"},
    {"--overwrite", "the sweep replaces what it did not finish, and nothing else"},
    {"--master", "each run of a sweep is a session of its own"},
    {"--movie", "all runs would write one file; telesplat movie makes one of a run's folder"},
};

namespace fs = std::filesystem;

constexpr int kAttempts = 2;
constexpr double kStarting_s = 4;  // time to start a run: a guess until one is done
constexpr double kUnknown_s = 10;  // a run that ends after a number of frames
constexpr double kLimitTimes = 10, kLimitMore_s = 600;

// Returns the flags of `telesplat run` by name; they set a struct that is not used.
const options::Table& run_flags() {
  static RunOptions options;
  static const options::Table flags = table(options);
  return flags;
}

}  // namespace

std::string complaint_in(const std::string& log) {
  std::istringstream in(log);
  std::string line, last, complaint;
  while (std::getline(in, line)) {
    std::erase_if(line, [](unsigned char c) { return c < ' ' || c == 0x7f; });
    if (line.starts_with("telesplat: ")) complaint = line.substr(11);
    if (!line.empty()) last = line;
  }
  return to_utf8((complaint.empty() ? last : complaint).substr(0, kLongestReason));
}

std::string last_words(const std::string& path, uintmax_t offset) {
  std::error_code error;
  const uintmax_t size = std::filesystem::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in || size <= offset) return {};
  const uintmax_t from = std::max(offset, size - std::min(size, kMostLastWords));
  in.seekg(std::streamoff(from));
  std::string out(size_t(size - from), '\0');
  in.read(out.data(), std::streamsize(out.size()));
  out.resize(size_t(in.gcount()));
  return out;
}

RunEnd carry_out(const RunRequest& request, const std::function<void(double)>& watch) {
  std::error_code error;
  const auto size = std::filesystem::file_size(request.log, error);
  const uintmax_t said_before = error ? 0 : size;
  auto child = ChildProcess::start("run", request.program, request.arguments, request.log, 0);
  if (!child) return {1, child.error().text, false, 0};
  Watch watched(*child, request.limit_s);
  watched.until_ended(watch);
  RunEnd out{child->exit_code(), {}, watched.stopped(), watched.elapsed_s()};
  if (watched.late())
    out.reason = fmt::format("took longer than {:.0f} s", request.limit_s);
  else if (out.exit_code != 0)
    out.reason = reason_for(out.exit_code, last_words(request.log, said_before));
  return out;
}

Result<double> check_run(const std::vector<std::string>& arguments) {
  RunOptions o;
  const options::Table flags = table(o);
  auto words = expand_scene_file(arguments, flags);
  if (!words) return words.error();
  options::Parser parser("");
  parser.add(flags);
  if (const Status s = parser.parse("telesplat run", std::move(*words)); !s) return s.error();
  const options::Given given = parser.given();
  for (const auto& [flag, why] : kRefused)
    if (std::find(given.begin(), given.end(), flag) != given.end())
      return Error{fmt::format("{}: is not for sweeps: {}", flag, why)};
  if (o.data.scene.empty()) return Error{"a scene is needed: telesplat sweep SCENE, or --vary scene=A,B"};
  o.out = "run";  // settle() needs a folder
  if (const auto scene = settle(o, given); !scene) return scene.error();
  const auto& display = o.viewer.display;
  if (display.span.duration_s <= 0 && display.span.frames == 0)
    return Error{"--duration 0: such a run does not end by itself"};
  return display.span.duration_s;
}

double expected_wall_s(const Manifest& m, size_t configuration, double lasts_s) {
  std::vector<double> own, all;
  for (const auto& [key, outcome] : m.outcomes) {
    if (!outcome.done) continue;
    all.push_back(outcome.wall_s);
    if (key.first == m.configurations[configuration].name) own.push_back(outcome.wall_s);
  }
  if (const auto& known = own.empty() ? all : own; !known.empty()) return metrics::distribution(known).median;
  return (lasts_s > 0 ? lasts_s : kUnknown_s) + kStarting_s;
}

Sweep::Sweep(Manifest manifest, std::string directory, std::string program, double limit_s)
    : manifest_(std::move(manifest)),
      directory_(std::move(directory)),
      program_(std::move(program)),
      limit_s_(limit_s),
      lasts_s_(manifest_.configurations.size(), 0) {}

Status Sweep::check() {
  for (size_t c = 0; c < manifest_.configurations.size(); ++c) {
    const auto lasts_s = check_run(arguments(manifest_.grid, manifest_.configurations[c], run_flags()));
    if (!lasts_s && manifest_.grid.axes.empty()) return lasts_s.error();
    if (!lasts_s)
      return Error{fmt::format("{}: {}", words(manifest_.grid, manifest_.configurations[c]), lasts_s.error().text)};
    lasts_s_[c] = *lasts_s;
  }
  return ok_status();
}

std::string Sweep::folder(const NextRun& run) const {
  return directory_ + "/" + run_folder(manifest_.configurations[run.configuration], run.repetition);
}

std::vector<NextRun> Sweep::to_do() const {
  std::vector<NextRun> out;
  for (const auto& [configuration, repetition] : run_order(manifest_.grid, manifest_.configurations.size())) {
    const NextRun run{configuration, repetition};
    const auto found = manifest_.outcomes.find({manifest_.configurations[configuration].name, repetition});
    std::error_code error;
    const bool done =
        found != manifest_.outcomes.end() && found->second.done && fs::exists(folder(run) + "/summary.json", error);
    if (!done) out.push_back(run);
  }
  return out;
}

std::vector<std::string> Sweep::command(const NextRun& run) const {
  std::vector<std::string> out{"run"};
  const auto own = arguments(manifest_.grid, manifest_.configurations[run.configuration], run_flags());
  out.insert(out.end(), own.begin(), own.end());
  out.insert(out.end(), {"--out", folder(run)});
  std::string label = words(manifest_.grid, manifest_.configurations[run.configuration]);
  if (manifest_.grid.repeat > 1) label += fmt::format(", run {}", run.repetition);
  out.insert(out.end(), {"--label", std::move(label)});
  // The folder's content comes from a run that did not end.
  std::error_code error;
  if (fs::exists(folder(run), error)) out.emplace_back("--overwrite");
  return out;
}

double Sweep::expected_s(size_t configuration) const {
  return expected_wall_s(manifest_, configuration, lasts_s_[configuration]);
}

Result<RunEnd> Sweep::attempt(const NextRun& run, const std::function<void(double)>& watch) const {
  std::error_code error;
  fs::create_directories(fs::path(folder(run)).parent_path(), error);
  if (error) return Error{fmt::format("{}: cannot be made: {}", folder(run), error.message())};
  const double lasts_s = lasts_s_[run.configuration];
  const double limit_s = limit_s_ > 0 ? limit_s_ : kLimitTimes * lasts_s + kLimitMore_s;
  return launcher::carry_out({program_, command(run), folder(run) + ".log", limit_s}, watch);
}

Result<Sweep::End> Sweep::carry_out(tools::ProgressLine& progress) {
  const auto runs_to_do = to_do();
  const size_t done_before = runs() - runs_to_do.size();
  for (size_t i = 0; i < runs_to_do.size(); ++i) {
    const NextRun& run = runs_to_do[i];
    const Configuration& c = manifest_.configurations[run.configuration];
    const std::string what = fmt::format("run {} of {}: {}, repetition {} of {}", done_before + i + 1, runs(),
                                         words(manifest_.grid, c), run.repetition, manifest_.grid.repeat);
    double later_s = 0;
    for (size_t k = i + 1; k < runs_to_do.size(); ++k) later_s += expected_s(runs_to_do[k].configuration);
    const double own_s = expected_s(run.configuration);
    RunOutcome outcome{.begin = fmt::format("{:%FT%T%z}", fmt::localtime(std::time(nullptr)))};
    while (!outcome.done && outcome.attempts < kAttempts) {
      const auto end = attempt(run, [&](double elapsed_s) {
        progress.show(fmt::format("{}: {:.0f} s, {} left", what, elapsed_s,
                                  tools::duration_text(std::max(0.0, own_s - elapsed_s) + later_s)));
      });
      if (!end) return end.error();
      ++outcome.attempts;
      outcome.exit_code = end->exit_code, outcome.reason = end->reason;
      outcome.wall_s = end->wall_s;
      outcome.done = end->reason.empty();
      if (!outcome.done && end->interrupted) return End::kInterrupted;
      if (!outcome.done)
        progress.line(fmt::format("telesplat: {} failed ({}){}", what, end->reason,
                                  outcome.attempts < kAttempts ? "; it is tried again" : ""));
      if (!outcome.done) continue;
      manifest_.outcomes[{c.name, run.repetition}] = outcome;
      if (const Status s = write_manifest(manifest_, directory_); !s) return s.error();
      if (end->interrupted) return End::kInterrupted;
    }
    if (outcome.done) continue;
    manifest_.outcomes[{c.name, run.repetition}] = outcome;
    if (const Status s = write_manifest(manifest_, directory_); !s) return s.error();
  }
  return End::kDone;
}

}  // namespace telesplat::launcher
