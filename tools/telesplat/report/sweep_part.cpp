#include "tools/telesplat/report/report.h"

#include <fmt/format.h>

#include <filesystem>

#include "common/core/utf8.h"
#include "tools/common/csv_table.h"
#include "tools/telesplat/record/skip.h"
#include "tools/telesplat/report/parts.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using tools::CsvTable;

constexpr const char* kFlag = "flag.";
constexpr size_t kMostShown = 12;  // configurations whose runs are laid over each other
constexpr CsvTable::Limits kRows{.rows = 100'000, .lenient = true};

std::string cell(const CsvTable& table, size_t row, const char* name) {
  const auto column = table.find(name);
  return column ? to_utf8(table.text(row, *column)) : std::string();
}

// Returns the flags that vary, and their columns.
std::vector<std::pair<std::string, size_t>> flags_of(const CsvTable& table) {
  std::vector<std::pair<std::string, size_t>> out;
  for (size_t i = 0; i < table.header().size(); ++i)
    if (table.header()[i].starts_with(kFlag)) out.emplace_back(to_utf8(table.header()[i].substr(5)), i);
  return out;
}

// Returns the folder of a completed run; empty: the run is not done, or the path leads out of the sweep.
std::string folder_of(const std::string& sweep, const CsvTable& table, size_t row) {
  const std::string name = cell(table, row, "folder");
  if (cell(table, row, "state") != "done" || name.empty() || fs::path(name).is_absolute()) return {};
  return lies_within(sweep, name) ? (fs::path(sweep) / name).string() : std::string();
}

// Returns the tests of each configuration against the first one.
ordered_json differences_in(const std::string& directory) {
  ordered_json out = ordered_json::array();
  if (!lies_within(directory, "cells.csv")) return out;
  const auto table = CsvTable::read(directory + "/cells.csv", kRows);
  if (!table) return out;
  const auto number = [&](size_t row, const char* name) {
    const auto column = table->find(name);
    const auto value = column ? table->number(row, *column) : Result<double>(Error{});
    return value ? ordered_json(*value) : ordered_json();
  };
  for (size_t row = 0; row < table->rows(); ++row)
    if (auto p = number(row, "p_holm"); !p.is_null())
      out.push_back({{"configuration", cell(*table, row, "configuration")},
                     {"path", cell(*table, row, "figure")},
                     {"mean", number(row, "difference")},
                     {"low", number(row, "difference_low")},
                     {"high", number(row, "difference_high")},
                     {"p", std::move(p)}});
  return out;
}

}  // namespace

bool is_sweep(const std::string& directory) {
  std::error_code error;
  return fs::is_regular_file(fs::path(directory) / "sweep.csv", error) && lies_within(directory, "sweep.csv");
}

Status take_sweep(const std::string& directory, ReportOptions& o) {
  const auto table = CsvTable::read(directory + "/sweep.csv", kRows);
  if (!table) return table.error();
  const auto flags = flags_of(*table);
  ordered_json configurations = ordered_json::object();
  std::vector<std::string> runs, labels;
  for (size_t row = 0; row < table->rows(); ++row) {
    auto& c = configurations[cell(*table, row, "configuration")];
    if (c.is_null()) {
      c = {{"values", ordered_json::array()}, {"noisy", cell(*table, row, "noisy")}, {"runs", ordered_json::array()}};
      for (const auto& [name, column] : flags) c["values"].push_back(to_utf8(table->text(row, column)));
    }
    ordered_json run{{"repetition", cell(*table, row, "repetition")},
                     {"state", cell(*table, row, "state")},
                     {"reason", cell(*table, row, "reason")},
                     {"figures", ordered_json::object()}};
    if (const std::string folder = folder_of(directory, *table, row); !folder.empty())
      if (const auto summary = summary_without_beginning(folder, o.skip_s)) {
        run["figures"] = figures_json(*summary, {}, {});
        if (!c.contains("shown") && runs.size() < kMostShown) {
          c["shown"] = runs.size();
          runs.push_back(folder);
          std::string label;
          for (size_t i = 0; i < flags.size(); ++i)
            label += fmt::format("{}{}={}", i ? " " : "", flags[i].first, c["values"][i].get<std::string>());
          labels.push_back(label.empty() ? "all runs" : label);
        }
      }
    c["runs"].push_back(std::move(run));
  }
  if (runs.empty()) return Error{fmt::format("{}: no run of the sweep is done", directory)};
  o.sweep = {{"flags", ordered_json::array()}, {"configurations", ordered_json::array()}};
  for (const auto& [name, column] : flags) o.sweep["flags"].push_back(name);
  for (auto& [name, c] : configurations.items()) {
    c["name"] = name;
    o.sweep["configurations"].push_back(std::move(c));
  }
  o.sweep["differences"] = differences_in(directory);
  o.runs = std::move(runs);
  if (o.labels.empty()) o.labels = std::move(labels);
  return ok_status();
}

}  // namespace telesplat::launcher
