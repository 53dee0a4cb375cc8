// Reports of recorded runs: a page, and pictures of plots for papers.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/movie/piped_process.h"
#include "tools/telesplat/report/reading/run_tables.h"

namespace telesplat::launcher {

struct ReportOptions {
  std::vector<std::string> runs;    ///< folders; the first is what others are compared with
  std::vector<std::string> labels;  ///< what the page calls them; none: as summary.json and folders do
  double skip_s = 0;                ///< of each run, left out
  std::string out;                  ///< the page; empty: report.html in the run, or beside the first of several runs
  std::string plots;                ///< folder of plots; empty: "plots" beside the page, STEM-plots of several runs
  bool no_plots = false;
};

struct ReportMade {
  std::string page;
  std::vector<std::string> plots;  ///< paths
  std::string no_plots;            ///< why there are none; empty: there are, or none were asked for
  bool interrupted = false;        ///< should_stop said so: nothing was written
};

/// Where the page and the plots go. Error: no run, a folder that is none, a label too few or too many, or a run that is
/// no longer than what is left out.
Result<ReportOptions> settle_report(ReportOptions options);

/// What a page shows of one run. runs: how many share the limits of the page.
nlohmann::ordered_json run_json(const std::string& directory, const std::string& name, size_t runs,
                                const PageLimits& limits = {}, double skip_s = 0);

/// Reads the runs and writes page and plots. Error: something cannot be written. Precondition: settle_report().
Result<ReportMade> make_report(const ReportOptions& options, tools::ProgressLine& progress,
                               const ShouldStop& should_stop);

/// Lines for the person: what was made, and what was not.
std::vector<std::string> lines_of(const ReportMade& made);

}  // namespace telesplat::launcher
