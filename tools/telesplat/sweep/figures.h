// Figures of runs: the numbers of summary.json by name, and those that a person wants first.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace telesplat::launcher {

/// Names and numbers, in the summary's order.
using Figures = std::vector<std::pair<std::string, double>>;

/// Every number of a summary, "inter_frame_delay_ms.median"; elements of lists by their place, "size.0".
Figures flatten(const nlohmann::ordered_json& summary);
const double* find(const Figures& figures, const std::string& name);

/// What tables show.
struct Measure {
  const char* name;   ///< in summary.json
  const char* title;  ///< for people
  const char* brief;  ///< head of a column
  const char* unit;
  int decimals;
  double scale;         ///< shown = measured * scale
  bool judges_machine;  ///< where runs of one configuration differ much in it, the machine was too noisy
};
std::span<const Measure> main_figures();
/// In the figure's unit, with its decimals; no unit.
std::string text_of(const Measure& figure, double measured);

struct Spread {
  int runs = 0;
  double median = 0, least = 0, most = 0;
  /// (most - least) / median; 0 where the median is 0.
  double relative() const { return median != 0 ? (most - least) / median : 0; }
};
/// Precondition: there is a value.
Spread spread_of(std::vector<double> values);

}  // namespace telesplat::launcher
