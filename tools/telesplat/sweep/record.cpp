#include "tools/telesplat/sweep/record.h"

#include <fmt/format.h>

#include "tools/common/json_file.h"

namespace telesplat::launcher {
namespace {

std::optional<Figures> read_figures(const std::string& path) {
  const auto summary = tools::read_json_file(path);
  if (!summary.is_object()) return std::nullopt;
  return flatten(summary);
}

}  // namespace

std::optional<Spread> SweepRecord::spread(size_t configuration, const std::string& figure) const {
  std::vector<double> values;
  for (const SweptRun& run : runs)
    if (run.configuration == configuration)
      if (const double* value = find(run.figures, figure)) values.push_back(*value);
  return values.empty() ? std::nullopt : std::optional(spread_of(std::move(values)));
}

std::string run_folder(const Configuration& configuration, int repetition) {
  return fmt::format("{}/{}", configuration.name, repetition);
}

SweepRecord read_record(const Manifest& m, const std::string& directory) {
  SweepRecord out{m.grid, m.configurations, {}};
  for (size_t c = 0; c < m.configurations.size(); ++c)
    for (int repetition = 1; repetition <= m.grid.repeat; ++repetition) {
      SweptRun run{c, repetition, run_folder(m.configurations[c], repetition), {}, {}};
      if (const auto found = m.outcomes.find({m.configurations[c].name, repetition}); found != m.outcomes.end())
        run.outcome = found->second;
      if (run.outcome && run.outcome->done) {
        auto figures = read_figures(directory + "/" + run.folder + "/summary.json");
        if (figures)
          run.figures = std::move(*figures);
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
