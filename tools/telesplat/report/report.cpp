#include "tools/telesplat/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "common/core/utf8.h"
#include "common/core/version.h"
#include "common/core/whole_file.h"
#include "common/metrics/run_folder.h"
#include "tools/telesplat/control/json_fields.h"
#include "tools/telesplat/record/skip.h"
#include "tools/telesplat/report/page.h"
#include "tools/telesplat/report/parts.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr size_t kMostRuns = 12, kLongestName = 100;
constexpr size_t kLeastBuckets = 500;  // for a series over time, with any number of runs

bool is_run(const std::string& directory) {
  std::error_code error;
  if (!fs::is_directory(directory, error)) return false;
  if (!metrics::folder_id(directory).empty()) return true;
  for (const char* file : {"frames.csv", "updates.csv", "summary.json", "trace.json"})
    if (fs::is_regular_file(fs::path(directory) / file, error)) return true;
  return false;
}

fs::path without_slash(const std::string& directory) {
  fs::path path = fs::path(directory).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();
  return path;
}

// Returns the run's label, else its folder's name; "latest" and "." are resolved.
std::string name_of(const std::string& run) {
  if (const std::string label = text(read_summary(run), "label"); !label.empty()) return label;
  std::error_code error;
  const fs::path real = fs::canonical(run, error);
  return (error ? without_slash(run) : real).filename().string();
}

// Returns a name for each run; equal names get a number.
std::vector<std::string> names_of(const ReportOptions& o) {
  std::vector<std::string> out;
  std::set<std::string> taken;
  for (size_t i = 0; i < o.runs.size(); ++i) {
    const std::string given = o.labels.empty() ? name_of(o.runs[i]) : o.labels[i];
    const std::string name = to_utf8(to_utf8(given.empty() ? "run" : given).substr(0, kLongestName));
    std::string own = name;
    for (int n = 2; !taken.insert(own).second; ++n) own = fmt::format("{} ({})", name, n);
    out.push_back(own);
  }
  return out;
}

ordered_json config_of(const std::string& directory, const PageLimits& limits) {
  if (!lies_within(directory, "session.toml")) return {};
  const auto text = read_whole(directory + "/session.toml", kMostSessionBytes);
  return text ? ordered_json(to_utf8(text->substr(0, limits.text_bytes))) : ordered_json();
}

// Lists the symbolic links of a run, which readers skip.
std::vector<std::string> links_in(const std::string& directory) {
  std::vector<std::string> out;
  std::error_code error;
  for (const char* folder : {"", "images", "logs"}) {
    if (*folder && !lies_within(directory, folder)) continue;
    for (fs::directory_iterator entry(fs::path(directory) / folder, error), end; !error && entry != end;
         entry.increment(error))
      if (fs::is_symlink(entry->symlink_status(error))) out.push_back(to_utf8(entry->path().filename().string()));
  }
  std::sort(out.begin(), out.end());
  return out;
}

// Returns the path of the run's trace; null: the run has no trace.
ordered_json trace_json(const std::string& directory) {
  const fs::path path = fs::path(directory) / "trace.json";
  std::error_code error;
  if (!lies_within(directory, "trace.json") || !fs::is_regular_file(path, error)) return {};
  return fs::absolute(path, error).lexically_normal().string();
}

// Makes a link from the page to a file.
std::string from_page(const std::string& page, const fs::path& file) {
  std::error_code error;
  return to_utf8(file.lexically_relative(fs::absolute(page, error).lexically_normal().parent_path()).string());
}

}  // namespace

Result<ReportOptions> settle_report(ReportOptions o) {
  if (o.runs.empty()) return Error{"a run folder is needed"};
  const std::string sweep = o.runs.size() == 1 && is_sweep(o.runs.front()) ? o.runs.front() : std::string();
  if (!sweep.empty())
    if (const Status s = take_sweep(sweep, o); !s) return s.error();
  if (o.runs.size() > kMostRuns)
    return Error{fmt::format("{} runs are given, a page compares at most {}", o.runs.size(), kMostRuns)};
  for (const auto& run : o.runs)
    if (!is_run(run)) return Error{fmt::format("{}: is no run folder", run)};
  if (!o.labels.empty() && o.labels.size() != o.runs.size())
    return Error{fmt::format("--label: {} are given for {} runs; each run needs one", o.labels.size(), o.runs.size())};
  for (const auto& run : o.runs)
    if (o.skip_s > 0 && read_summary(run).is_object())
      if (const auto later = summary_without_beginning(run, o.skip_s); !later) return later.error();
  if (o.out.empty()) {
    const fs::path first = without_slash(sweep.empty() ? o.runs.front() : sweep);
    o.out = ((o.runs.size() > 1 && sweep.empty() ? first.parent_path() : first) / "report.html").string();
  }
  std::error_code error;
  if (fs::is_directory(o.out, error)) return Error{fmt::format("--out {}: is a folder, not a file", o.out)};
  return o;
}

ordered_json run_json(const std::string& directory, const std::string& name, size_t runs, const PageLimits& limits,
                      double skip_s) {
  ordered_json summary = read_summary(directory);
  if (summary.is_object())
    if (auto later = summary_without_beginning(directory, skip_s)) summary = *std::move(later);
  RunTables tables = read_run_tables(directory, text(summary, "kind"), skip_s);
  if (skip_s > 0)
    tables.notes.push_back(
        fmt::format("the first {} s are left out (--skip); memory, errors and points cached are of "
                    "the whole run",
                    skip_s));
  if (!summary.is_object())
    tables.notes.emplace_back(
        "summary.json is not there or cannot be read: the run has not ended in order; what is told here comes from its "
        "tables");
  if (const auto links = links_in(directory); !links.empty())
    tables.notes.push_back(fmt::format("{} symbolic link{} not looked into, such as {}", links.size(),
                                       links.size() == 1 ? " is" : "s are", links.front()));
  ordered_json out{{"name", name}, {"directory", to_utf8(directory)}, {"facts", facts_json(summary)}};
  out["finished"] = summary.is_object();
  out["origin_s"] = tables.origin_s;
  out["duration_s"] = tables.duration_s();
  out["spreads"] = spreads(tables);
  out["figures"] = figures_json(summary, out["spreads"], tables);
  PageLimits own = limits;
  own.buckets = std::max(std::min(limits.buckets, kLeastBuckets), limits.buckets / runs);
  out["series"] = time_series(tables, own);
  out["stages"] = stages_json(tables, own);
  out["walk"] = walk_json(tables, limits);
  out["trace"] = trace_json(directory);
  out["pictures"] = pictures_json(directory, tables, limits, limits.picture_bytes / runs);
  out["config"] = config_of(directory, limits);
  out["logs"] = logs_json(directory);
  out["notes"] = tables.notes;
  return out;
}

Result<ReportMade> make_report(const ReportOptions& o, tools::ProgressLine& progress,
                               const tools::ShouldStop& should_stop) {
  const auto names = names_of(o);
  ordered_json data{{"version", version()}, {"figures", figure_kinds()}, {"runs", ordered_json::array()}};
  if (!o.sweep.is_null()) data["sweep"] = o.sweep;
  ReportMade made;
  for (size_t i = 0; i < o.runs.size(); ++i) {
    progress.show(fmt::format("report: reading {}, run {} of {}", names[i], i + 1, o.runs.size()));
    auto& run = data["runs"].emplace_back(run_json(o.runs[i], names[i], o.runs.size(), {}, o.skip_s));
    if (!run["trace"].is_null()) run["trace"] = from_page(o.out, run["trace"].get<std::string>());
    if (should_stop()) {
      made.interrupted = true;
      return made;
    }
  }
  std::string title = "Telesplat report: " + names.front();
  for (size_t i = 1; i < names.size(); ++i) title += (i + 1 < names.size() ? ", " : " and ") + names[i];
  std::error_code error;
  if (const auto folder = fs::path(o.out).parent_path(); !folder.empty()) fs::create_directories(folder, error);
  if (const Status s = write_whole(o.out, page_html(title, data)); !s) return s.error();
  made.page = o.out;
  return made;
}

std::string line_of(const ReportMade& made) {
  std::error_code error;
  const double mb = double(fs::file_size(made.page, error)) / 1e6;
  return fmt::format("The report is {} ({:.1f} MB); open it in a browser", made.page, error ? 0.0 : mb);
}

}  // namespace telesplat::launcher
