// The figures of a sweep, as its tables and the report read them.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tools/telesplat/sweep/manifest.h"

namespace telesplat::launcher {

/// Names and numbers, in the summary's order.
using Figures = std::vector<std::pair<std::string, double>>;

/// Returns every number of a summary, "inter_frame_delay_ms.median"; elements of lists by index, "size.0".
Figures flatten(const nlohmann::ordered_json& summary);
const double* find(const Figures& figures, const std::string& name);

/// A figure in tables.
struct Measure {
  const char* name;   ///< key in summary.json
  const char* title;  ///< for people
  const char* brief;  ///< head of a column
  const char* unit;
  int decimals;
  double scale;         ///< shown = measured * scale
  bool judges_machine;  ///< if it differs much among runs of one configuration, the machine was too noisy
};
std::span<const Measure> main_figures();
/// Writes the number in the figure's unit, with its decimals, without the unit.
std::string text_of(const Measure& figure, double measured);

struct Spread {
  int runs = 0;
  double median = 0, least = 0, most = 0;
  /// (most - least) / median; 0 if the median is 0.
  double relative() const { return median != 0 ? (most - least) / median : 0; }
};
/// Precondition: values is not empty.
Spread spread_of(std::vector<double> values);

struct SweptRun {
  size_t configuration = 0;
  int repetition = 1;
  std::string folder;                 ///< relative to the sweep's folder
  std::optional<RunOutcome> outcome;  ///< nothing: the run has not ended
  Figures figures;                    ///< those of its summary.json, if it is done
};

struct SweepRecord {
  Grid grid;
  std::vector<Configuration> configurations;
  std::vector<SweptRun> runs;  ///< configuration after configuration

  /// Returns a figure's values, from those finished runs of a configuration that have it.
  std::vector<double> values(size_t configuration, const std::string& figure) const;
  /// Spread of values(); nothing: no run has the figure.
  std::optional<Spread> spread(size_t configuration, const std::string& figure) const;
};

/// "coupling-sync/2"
std::string run_folder(const Configuration& configuration, int repetition);

/// Reads the summaries of all completed runs, without the first skip_s seconds of each. A run without a readable
/// summary.json counts as not done, one no longer than skip_s as failed.
SweepRecord read_record(const Manifest& manifest, const std::string& directory, double skip_s = 0);

/// A configuration whose runs differ by more than kMostSpread in a main figure: they may measure the machine rather
/// than the configuration.
struct Noise {
  size_t configuration;
  const Measure* figure;
  Spread spread;
};
inline constexpr int kLeastRepetitions = 3;
inline constexpr double kMostSpread = 0.1;  ///< (most - least) / median

/// Checks inter-frame delay and view update latency (medians of a run): returns them if at least kLeastRepetitions runs
/// have them and they differ by more than kMostSpread.
std::vector<Noise> noises(const SweepRecord& record);
/// "coupling=sync: 3 runs differ by 23 % in ...: the machine was too noisy ..."
std::string sentence(const SweepRecord& record, const Noise& noise);

/// Returns "coupling=sync, run 2: exit code 1: ..." for every failed run.
std::vector<std::string> failures(const SweepRecord& record);

}  // namespace telesplat::launcher
