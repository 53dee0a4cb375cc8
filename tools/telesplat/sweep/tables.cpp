#include "tools/telesplat/sweep/tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

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

// Of all runs, in the order in which summaries have them: what a run has more goes behind what precedes it there.
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

// The figures of its configuration that are too noisy, with blanks between.
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
    out.resize(out.size() + 9);
  } else {
    out.insert(out.end(), {o.reason, std::to_string(o.attempts), std::to_string(o.exit_code), o.begin});
    for (const double v : {o.wall_s, o.load.before, o.load.after, o.load.own_cpu, o.load.others_cpu})
      out.push_back(fmt::format("{:.4g}", v));
  }
  out.insert(out.end(), {noisy_figures(noise, run.configuration), run.folder});
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
  const std::vector<std::string> columns_of_run{"state",     "reason",     "attempts",    "exit_code",
                                                "run_begin", "wall_s",     "load_before", "load_after",
                                                "own_cpu",   "others_cpu", "noisy",       "folder"};
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

}  // namespace telesplat::launcher
