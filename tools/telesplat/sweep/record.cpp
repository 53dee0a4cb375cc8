#include "tools/telesplat/sweep/record.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "common/core/check.h"
#include "common/metrics/statistics.h"
#include "tools/telesplat/record/skip.h"

namespace telesplat::launcher {
namespace {

void flatten_into(const nlohmann::ordered_json& value, const std::string& name, Figures& out) {
  const auto within = [&](const std::string& key) { return name.empty() ? key : name + "." + key; };
  if (value.is_number())
    out.emplace_back(name, value.get<double>());
  else if (value.is_object())
    for (const auto& [key, inner] : value.items()) flatten_into(inner, within(key), out);
  else if (value.is_array())
    for (size_t i = 0; i < value.size(); ++i) flatten_into(value[i], within(std::to_string(i)), out);
}

constexpr std::array kMeasures{
    Measure{"motion_to_photon_ms.median", "motion to photon, median", "m2p ms", "ms", 1, 1, false},
    Measure{"motion_to_photon_ms.p95", "motion to photon, 95th percentile", "m2p p95", "ms", 1, 1, false},
    Measure{"fps", "displayed frames a second", "fps", "1/s", 1, 1, false},
    Measure{"inter_frame_delay_ms.median", "inter-frame delay, median", "delay ms", "ms", 1, 1, true},
    Measure{"inter_frame_delay_ms.p95", "inter-frame delay, 95th percentile", "p95", "ms", 1, 1, false},
    Measure{"view_update_latency_ms.median", "view update latency, median", "latency ms", "ms", 1, 1, true},
    Measure{"updates_per_s", "view updates a second", "updates/s", "1/s", 2, 1, false},
    Measure{"update_age_ms.p95", "age of the displayed update, 95th percentile", "age p95", "ms", 0, 1, false},
    Measure{"data_transfer_rate_mb_s", "sent to viewers", "MB/s", "MB/s", 2, 1, false},
    Measure{"quality.psnr_db.median", "PSNR, median", "PSNR dB", "dB", 2, 1, false},
    Measure{"quality.ssim.median", "SSIM, median", "SSIM", "", 4, 1, false},
    Measure{"quality.hole_fraction.mean", "holes, mean", "holes %", "%", 3, 100, false}};

}  // namespace

Figures flatten(const nlohmann::ordered_json& summary) {
  Figures out;
  flatten_into(summary, "", out);
  return out;
}

const double* find(const Figures& figures, const std::string& name) {
  const auto found = std::find_if(figures.begin(), figures.end(), [&](const auto& f) { return f.first == name; });
  return found == figures.end() ? nullptr : &found->second;
}

std::span<const Measure> main_figures() { return kMeasures; }

std::string text_of(const Measure& figure, double measured) {
  return fmt::format("{:.{}f}", measured * figure.scale, figure.decimals);
}

Spread spread_of(std::vector<double> values) {
  CHECK(!values.empty());
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return {int(values.size()), metrics::distribution(values).median, *least, *most};
}

std::vector<double> SweepRecord::values(size_t configuration, const std::string& figure) const {
  std::vector<double> out;
  for (const SweptRun& run : runs)
    if (run.configuration == configuration)
      if (const double* value = find(run.figures, figure)) out.push_back(*value);
  return out;
}

std::optional<Spread> SweepRecord::spread(size_t configuration, const std::string& figure) const {
  std::vector<double> all = values(configuration, figure);
  return all.empty() ? std::nullopt : std::optional(spread_of(std::move(all)));
}

std::string run_folder(const Configuration& configuration, int repetition) {
  return fmt::format("{}/{}", configuration.name, repetition);
}

SweepRecord read_record(const Manifest& m, const std::string& directory, double skip_s) {
  SweepRecord out{m.grid, m.configurations, {}};
  for (size_t c = 0; c < m.configurations.size(); ++c)
    for (int repetition = 1; repetition <= m.grid.repeat; ++repetition) {
      SweptRun run{c, repetition, run_folder(m.configurations[c], repetition), {}, {}};
      if (const auto found = m.outcomes.find({m.configurations[c].name, repetition}); found != m.outcomes.end())
        run.outcome = found->second;
      if (run.outcome && run.outcome->done) {
        const std::string folder = directory + "/" + run.folder;
        if (const auto summary = summary_without_beginning(folder, skip_s))
          run.figures = flatten(*summary);
        else if (skip_s > 0 && summary_without_beginning(folder, 0))
          run.outcome->done = false, run.outcome->reason = summary.error().text;
        else
          run.outcome.reset();
      }
      out.runs.push_back(std::move(run));
    }
  return out;
}

std::vector<Noise> noises(const SweepRecord& record) {
  std::vector<Noise> out;
  for (size_t c = 0; c < record.configurations.size(); ++c)
    for (const Measure& figure : main_figures()) {
      if (!figure.judges_machine) continue;
      const auto spread = record.spread(c, figure.name);
      if (spread && spread->runs >= kLeastRepetitions && spread->relative() > kMostSpread)
        out.push_back({c, &figure, *spread});
    }
  return out;
}

std::string sentence(const SweepRecord& record, const Noise& n) {
  return fmt::format(
      "{}: {} runs differ by {:.0f} % in {} ({} to {} {}): the machine was too noisy to tell smaller differences",
      words(record.grid, record.configurations[n.configuration]), n.spread.runs, 100 * n.spread.relative(),
      n.figure->title, text_of(*n.figure, n.spread.least), text_of(*n.figure, n.spread.most), n.figure->unit);
}

std::vector<std::string> failures(const SweepRecord& record) {
  std::vector<std::string> out;
  for (const SweptRun& run : record.runs)
    if (run.outcome && !run.outcome->done)
      out.push_back(fmt::format("{}, run {}: {}", words(record.grid, record.configurations[run.configuration]),
                                run.repetition, run.outcome->reason));
  return out;
}

}  // namespace telesplat::launcher
