#include "tools/telesplat/sweep/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <filesystem>

#include "common/metrics/statistics.h"
#include "tools/telesplat/run/run_options.h"
#include "tools/telesplat/sweep/check.h"
#include "tools/telesplat/sweep/record.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr int kAttempts = 2;
constexpr double kStarting_s = 4;  // of a run, beside what it lasts: a guess until one is done
constexpr double kUnknown_s = 10;  // a run that ends after a number of frames
constexpr double kLimitTimes = 10, kLimitMore_s = 600;

std::string date_and_time() {
  char text[40];
  const std::time_t now = std::time(nullptr);
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S%z", std::localtime(&now));
  return text;
}

// Flags of `telesplat run` by name; nothing is read into them.
const options::Table& run_flags() {
  static RunOptions options;
  static const options::Table flags = table(options);
  return flags;
}

}  // namespace

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
  // What lies there is of a run that did not end.
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
    RunOutcome outcome{.begin = date_and_time()};
    while (!outcome.done && outcome.attempts < kAttempts) {
      const auto end = attempt(run, [&](double elapsed_s) {
        progress.show(fmt::format("{}: {:.0f} s, {} left", what, elapsed_s,
                                  tools::duration_text(std::max(0.0, own_s - elapsed_s) + later_s)));
      });
      if (!end) return end.error();
      ++outcome.attempts;
      outcome.exit_code = end->exit_code, outcome.reason = end->reason;
      outcome.wall_s = end->wall_s, outcome.load = end->load;
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
