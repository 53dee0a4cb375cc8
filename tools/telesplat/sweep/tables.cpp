#include "tools/telesplat/sweep/tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "common/metrics/statistics.h"
#include "tools/common/text_table.h"

namespace telesplat::launcher {
namespace {

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == text.npos) return text;
  std::string out = "\"";
  for (const char c : text) {
    if (c == '\n' || c == '\r') {
      out += ' ';
      continue;
    }
    if (c == '"') out += '"';
    out += c;
  }
  return out + "\"";
}

// Merges the names of all runs in the order of their summaries: a new name follows the one before it there.
std::vector<std::string> figure_names(const SweepRecord& record) {
  std::vector<std::string> out;
  std::set<std::string> known;
  for (const SweptRun& run : record.runs) {
    auto at = out.begin();
    for (const auto& [name, value] : run.figures)
      if (known.insert(name).second)
        at = out.insert(at, name) + 1;
      else if (const auto found = std::find(at, out.end(), name); found != out.end())
        at = found + 1;
  }
  return out;
}

std::string state_of(const SweptRun& run) { return !run.outcome ? "open" : run.outcome->done ? "done" : "failed"; }

// Returns a configuration's figures that are too noisy, with blanks between.
std::string noisy_figures(const std::vector<Noise>& all, size_t configuration) {
  std::string out;
  for (const Noise& n : all)
    if (n.configuration == configuration) out += (out.empty() ? "" : " ") + std::string(n.figure->name);
  return out;
}

std::vector<std::string> run_cells(const SweepRecord& record, const SweptRun& run, const std::vector<Noise>& noise) {
  const Configuration& c = record.configurations[run.configuration];
  std::vector<std::string> out{c.name, std::to_string(run.repetition)};
  out.insert(out.end(), c.values.begin(), c.values.end());
  const RunOutcome o = run.outcome.value_or(RunOutcome{});
  out.push_back(state_of(run));
  if (!run.outcome) {
    out.resize(out.size() + 5);
  } else {
    out.insert(out.end(), {o.reason, std::to_string(o.attempts), std::to_string(o.exit_code), o.begin,
                           fmt::format("{:.4g}", o.wall_s)});
  }
  out.insert(out.end(), {noisy_figures(noise, run.configuration), run.folder});
  return out;
}

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

void add_line(std::string& out, const std::vector<std::string>& cells) {
  for (size_t i = 0; i < cells.size(); ++i) out += (i ? "," : "") + csv_field(cells[i]);
  out += "\n";
}

std::string to_csv(const SweepRecord& record) {
  std::vector<std::string> columns{"configuration", "repetition"};
  for (const Axis& axis : record.grid.axes) columns.push_back("flag." + axis.flag);
  const std::vector<std::string> columns_of_run{"state",     "reason", "attempts", "exit_code",
                                                "run_begin", "wall_s", "noisy",    "folder"};
  columns.insert(columns.end(), columns_of_run.begin(), columns_of_run.end());
  const auto figures = figure_names(record);
  columns.insert(columns.end(), figures.begin(), figures.end());
  std::string out;
  add_line(out, columns);
  const auto noise = noises(record);
  for (const SweptRun& run : record.runs) {
    auto cells = run_cells(record, run, noise);
    for (const std::string& name : figures) {
      const double* value = find(run.figures, name);
      cells.push_back(value ? fmt::format("{}", *value) : std::string());
    }
    add_line(out, cells);
  }
  return out;
}

std::string text_of(const Measure& figure, const Spread& spread) {
  const std::string median = text_of(figure, spread.median), least = text_of(figure, spread.least),
                    most = text_of(figure, spread.most);
  return least == most ? median : fmt::format("{} ({}..{})", median, least, most);
}

std::string to_text(const SweepRecord& record) {
  std::vector<tools::TextTable::Column> columns;
  for (const Axis& axis : record.grid.axes) columns.push_back({axis.flag, false});
  columns.push_back({"runs"});
  for (const Measure& f : main_figures()) columns.push_back({f.brief});
  tools::TextTable table(columns);
  const auto noise = noises(record);
  for (size_t c = 0; c < record.configurations.size(); ++c) {
    std::vector<std::string> cells;
    for (const std::string& value : record.configurations[c].values) cells.push_back(tools::shortened(value, 24));
    const auto done = std::count_if(record.runs.begin(), record.runs.end(), [&](const SweptRun& r) {
      return r.configuration == c && r.outcome && r.outcome->done;
    });
    cells.push_back(fmt::format("{}/{}", done, record.grid.repeat));
    for (const Measure& f : main_figures()) {
      const auto spread = record.spread(c, f.name);
      const bool noisy = std::any_of(noise.begin(), noise.end(),
                                     [&](const Noise& n) { return n.configuration == c && n.figure == &f; });
      cells.push_back(spread ? text_of(f, *spread) + (noisy ? " !" : "") : "");
    }
    table.add(std::move(cells));
  }
  return table.text();
}

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
