#include "tools/telesplat/tune/tune.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "tools/common/json_file.h"

namespace telesplat::launcher {
namespace {

constexpr int kAttempts = 2;
constexpr double kStarting_s = 5;  // of a run, beside what it lasts: a guess until one is done
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr TuneFigures kNoFigures{kNaN, kNaN, kNaN, kNaN, kNaN};  // of a run that did not come to its end
constexpr double kLimitTimes = 10, kLimitMore_s = 600;

Result<TuneFigures> read_figures(const std::string& folder) {
  const auto summary = tools::read_json_object(folder + "/summary.json");
  if (!summary) return summary.error();
  return tune_figures(flatten(*summary));
}

}  // namespace

Tune::Tune(TuneSubject subject, std::string directory, std::string program)
    : subject_(std::move(subject)), directory_(std::move(directory)), program_(std::move(program)) {}

std::vector<TuneSettings> Tune::measuring() const {
  const TuneSettings& d = subject_.defaults;
  const TuneGrid& g = subject_.grid;
  TuneSettings many = d, fine = d;
  // As many samplers as there are cores, where that is free; tiles of another size.
  const int cores = std::max(2, int(subject_.base.cores));
  for (const int n : g.samplers)
    if (n > d.samplers && n <= cores) many.samplers = n;
  if (g.tile_px.size() > 1) many.tile_px = d.tile_px > 128 ? d.tile_px / 2 : d.tile_px * 2;
  if (!g.scale.empty()) fine.scale = g.scale.back(), fine.adaptive = false;
  std::vector<TuneSettings> out{d};
  for (const TuneSettings& s : {many, fine})
    if (s != d && !(subject_.request.quick && out.size() == 2)) out.push_back(s);
  return out;
}

Result<RunEnd> Tune::run(const TuneSettings& settings, const std::string& name, bool verified, const std::string& what,
                         tools::ProgressLine& progress) {
  namespace fs = std::filesystem;
  const std::string folder = directory_ + "/" + name;
  const double guess_s = subject_.run_s + kStarting_s;
  RunEnd end;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    std::error_code error;
    fs::create_directories(fs::path(folder).parent_path(), error);
    if (error) return Error{fmt::format("{}: cannot be made: {}", folder, error.message())};
    auto arguments = run_words(subject_, settings, folder, verified);
    if (fs::exists(folder, error)) arguments.emplace_back("--overwrite");
    const double each_s = done_ > 0 ? wall_s_ / double(done_) : guess_s;
    end = launcher::carry_out(
        {program_, arguments, folder + ".log", kLimitTimes * subject_.run_s + kLimitMore_s}, [&](double elapsed_s) {
          const double later_s = each_s * double(runs_ > done_ + 1 ? runs_ - done_ - 1 : 0);
          progress.show(fmt::format("run {} of {}: {}: {:.0f} s, {} left", done_ + 1, runs_, what, elapsed_s,
                                    tools::duration_text(std::max(0.0, each_s - elapsed_s) + later_s)));
        });
    if (end.interrupted) return end;
    if (end.reason.empty()) break;
    progress.line(fmt::format("telesplat: {} failed ({}){}", what, end.reason,
                              attempt + 1 < kAttempts ? "; it is tried again" : ""));
  }
  ++done_;
  wall_s_ += end.wall_s;
  return end;
}

Result<Tune::End> Tune::measure(tools::ProgressLine& progress) {
  std::vector<CostSamples> samples;
  const auto all = measuring();
  for (size_t i = 0; i < all.size(); ++i) {
    const std::string what = "costs, " + words(subject_, all[i]);
    const std::string name = fmt::format("costs-{}", i + 1);
    const auto end = run(all[i], name, false, what, progress);
    if (!end) return end.error();
    if (end->interrupted) return End::kInterrupted;
    if (!end->reason.empty() && i == 0) return Error{fmt::format("costs cannot be measured: {}", end->reason)};
    if (!end->reason.empty()) continue;
    auto read = read_costs(directory_ + "/" + name, subject_.base.slices);
    if (!read && i == 0) return read.error();
    if (!read) {
      progress.line("telesplat: " + read.error().text);
      continue;
    }
    read->others = end->load.others_cpu;
    read->octree_depth = all[i].octree_depth, read->tile_px = all[i].tile_px;
    samples.push_back(std::move(*read));
  }
  if (subject_.defaults.adaptive) subject_.defaults.scale = adaptive_scale(samples.front());
  costs_ = fit_costs(subject_.base, subject_.link_stated, samples);
  for (const std::string& line : describe(costs_)) progress.line("  " + line);
  return End::kDone;
}

Result<Tune::End> Tune::check(tools::ProgressLine& progress) {
  checked_.push_back({subject_.defaults, predict(costs_, subject_.defaults), {"defaults", {}}});
  for (const Candidate& c : propose(costs_, subject_.defaults, subject_.grid, candidates()))
    checked_.push_back({c.settings, c.predicted, {words(subject_, c.settings), {}}});
  // Where the model knows nothing better, there is nothing to compare with.
  runs_ = done_ + (checked_.size() > 1 ? checked_.size() * size_t(repetitions()) : 1);
  if (checked_.size() == 1) progress.line("the model proposes nothing better than the defaults");
  const int rounds = checked_.size() > 1 ? repetitions() : 1;
  // In turn, so that a machine that becomes slower does so for all.
  for (int round = 1; round <= rounds; ++round)
    for (size_t i = 0; i < checked_.size(); ++i) {
      Checked& c = checked_[i];
      const std::string name = fmt::format("{}/{}", i == 0 ? "defaults" : fmt::format("candidate-{}", i), round);
      const std::string what = fmt::format("check, {}, {} of {}", c.measured.name, round, rounds);
      const auto end = run(c.settings, name, true, what, progress);
      if (!end) return end.error();
      if (end->interrupted) return End::kInterrupted;
      auto figures = end->reason.empty() ? read_figures(directory_ + "/" + name) : Result<TuneFigures>(kNoFigures);
      if (!figures) return figures.error();
      c.measured.runs.push_back(*figures);
    }
  const auto& runs = checked_[0].measured.runs;
  if (std::none_of(runs.begin(), runs.end(), [](const TuneFigures& f) { return f.updates_per_s >= 0; }))
    return Error{"no run of the defaults came to its end"};
  return End::kDone;
}

Result<Tune::End> Tune::carry_out(tools::ProgressLine& progress) {
  runs_ = measuring().size() + size_t((candidates() + 1) * repetitions());
  progress.line(fmt::format("at most {} runs, {}; they are kept in {}", runs_,
                            tools::duration_text(double(runs_) * (subject_.run_s + kStarting_s)), directory_));
  for (const auto part : {&Tune::measure, &Tune::check}) {
    const auto end = (this->*part)(progress);
    if (!end || *end == End::kInterrupted) return end;
  }
  std::vector<Measured> measured;
  for (const Checked& c : checked_) measured.push_back(c.measured);
  choice_ = choose(measured);
  return End::kDone;
}

}  // namespace telesplat::launcher
