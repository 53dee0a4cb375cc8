#include "tools/telesplat/sweep/cells/cells.h"

#include <fmt/format.h>

#include "common/metrics/statistics.h"
#include "tools/telesplat/sweep/tables.h"

namespace telesplat::launcher {
namespace {

std::string number(double value) { return fmt::format("{:.6g}", value); }

std::vector<std::string> statistics_of(const Cell& c) {
  const auto d = metrics::distribution(c.runs);
  const auto interval = tools::mean_interval(c.runs);
  std::vector<std::string> out{std::to_string(c.runs.size()), number(d.mean), number(d.median),
                               interval ? number(d.sd) : ""};
  for (const double tools::Interval::*end : {&tools::Interval::low, &tools::Interval::high})
    out.push_back(interval ? number((*interval).*end) : "");
  if (!c.difference) {
    out.resize(out.size() + 5);
    return out;
  }
  for (const double v :
       {c.difference->mean, c.difference->interval.low, c.difference->interval.high, c.difference->p, c.p_holm})
    out.push_back(number(v));
  return out;
}

}  // namespace

std::vector<Cell> cells_of(const SweepRecord& record) {
  std::vector<Cell> out;
  for (const Measure& figure : main_figures()) {
    const size_t begin = out.size();
    bool any = false;
    for (size_t c = 0; c < record.configurations.size(); ++c) {
      out.push_back({c, &figure, record.values(c, figure.name), {}, 1});
      any = any || !out.back().runs.empty();
    }
    if (!any) {
      out.resize(begin);
      continue;
    }
    std::vector<double> p;
    for (size_t i = begin + 1; i < out.size(); ++i)
      if ((out[i].difference = tools::difference(out[begin].runs, out[i].runs))) p.push_back(out[i].difference->p);
    const auto raised = tools::holm(p);
    for (size_t i = begin + 1, k = 0; i < out.size(); ++i)
      if (out[i].difference) out[i].p_holm = raised[k++];
  }
  return out;
}

std::string cells_csv(const SweepRecord& record) {
  std::vector<std::string> columns{"configuration"};
  for (const Axis& axis : record.grid.axes) columns.push_back("flag." + axis.flag);
  const std::vector<std::string> columns_of_cell{
      "figure",    "runs",       "mean",           "median",          "sd", "mean_low",
      "mean_high", "difference", "difference_low", "difference_high", "p",  "p_holm"};
  columns.insert(columns.end(), columns_of_cell.begin(), columns_of_cell.end());
  std::string out;
  add_line(out, columns);
  for (const Cell& cell : cells_of(record)) {
    const Configuration& c = record.configurations[cell.configuration];
    std::vector<std::string> row{c.name};
    row.insert(row.end(), c.values.begin(), c.values.end());
    row.emplace_back(cell.figure->name);
    const auto statistics = statistics_of(cell);
    row.insert(row.end(), statistics.begin(), statistics.end());
    add_line(out, row);
  }
  return out;
}

std::string too_few(const Grid& grid) {
  if (grid.repeat >= kLeastRepetitions) return {};
  return fmt::format(
      "{} of each configuration: {}, and whether the machine was too noisy cannot be told with fewer than {}",
      grid.repeat == 1 ? "one run" : "two runs",
      grid.repeat == 1 ? "there are no intervals and no tests" : "intervals are wide", kLeastRepetitions);
}

}  // namespace telesplat::launcher
