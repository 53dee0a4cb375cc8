// Reports of recorded runs, or of a sweep: a page.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/report/reading/run_tables.h"

namespace telesplat::launcher {

struct ReportOptions {
  std::vector<std::string> runs;    ///< folders; the first is what others are compared with; or a sweep's folder alone
  std::vector<std::string> labels;  ///< what the page calls them; none: as summary.json and folders do
  double skip_s = 0;                ///< of each run, left out
  std::string out;                  ///< the page; empty: report.html in the run, or beside the first of several runs
  nlohmann::ordered_json sweep;     ///< of settle_report(): what a page shows of a sweep; null: it is of runs
};

struct ReportMade {
  std::string page;
  bool interrupted = false;  ///< should_stop said so: nothing was written
};

/// Where the page goes, and which runs it shows. Error: no run, a folder that is none, a sweep beside other runs, a
/// label too few or too many, or a run that is no longer than what is left out.
Result<ReportOptions> settle_report(ReportOptions options);

/// What a page shows of one run. runs: how many share the limits of the page.
nlohmann::ordered_json run_json(const std::string& directory, const std::string& name, size_t runs,
                                const PageLimits& limits = {}, double skip_s = 0);

/// Reads the runs and writes the page. Error: something cannot be written. Precondition: settle_report().
Result<ReportMade> make_report(const ReportOptions& options, tools::ProgressLine& progress,
                               const tools::ShouldStop& should_stop);

/// What was made, for people.
std::string line_of(const ReportMade& made);

bool is_sweep(const std::string& directory);

/// Puts into `options` what a page shows of a sweep, and as runs the first that is done of each configuration, named
/// by the flags that vary. Error: sweep.csv is none, or no run is done.
Status take_sweep(const std::string& directory, ReportOptions& options);

}  // namespace telesplat::launcher
