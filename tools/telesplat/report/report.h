// Makes a page about recorded runs, or about a sweep.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/report/reading/run_tables.h"

namespace telesplat::launcher {

struct ReportOptions {
  std::vector<std::string> runs;    ///< run folders, all compared with the first; or a single sweep folder
  std::vector<std::string> labels;  ///< names of the runs on the page; empty: those of summary.json and folders
  double skip_s = 0;                ///< left out at the begin of each run
  std::string out;                  ///< the page; empty: report.html in the run, or beside the first of several runs
  nlohmann::ordered_json sweep;     ///< set by settle_report(): a sweep's part of the page; null: runs
};

struct ReportMade {
  std::string page;
  bool interrupted = false;  ///< should_stop returned true: no page was written
};

/// Chooses the page's path and its runs. Error: no run, a folder without a run, a sweep beside other runs, a label too
/// few or too many, or a run no longer than the time left out.
Result<ReportOptions> settle_report(ReportOptions options);

/// Returns a run's part of the page. runs: number of runs that share the limits of the page.
nlohmann::ordered_json run_json(const std::string& directory, const std::string& name, size_t runs,
                                const PageLimits& limits = {}, double skip_s = 0);

/// Reads the runs and writes the page. Error: a file cannot be written. Precondition: settle_report().
Result<ReportMade> make_report(const ReportOptions& options, tools::ProgressLine& progress,
                               const tools::ShouldStop& should_stop);

/// Returns a line for people that names the page.
std::string line_of(const ReportMade& made);

bool is_sweep(const std::string& directory);

/// Puts the sweep's part of a page into `options`, and as runs the first completed one of each configuration, named by
/// the flags that vary. Error: sweep.csv is no such table, or no run is done.
Status take_sweep(const std::string& directory, ReportOptions& options);

}  // namespace telesplat::launcher
