#include "tools/telesplat/sweep/record.h"

#include <fmt/format.h>

#include "tools/telesplat/record/skip.h"

namespace telesplat::launcher {
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
