// `telesplat report DIR [DIR...]`: a page about recorded runs, one or several beside each other.
#include <cstdio>

#include "common/core/log.h"
#include "common/net/service.h"
#include "tools/common/complain.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/movie/movie.h"
#include "tools/telesplat/report/report.h"

namespace telesplat::launcher {
namespace {

options::Table table(ReportOptions& o) {
  return {{.flag = "runs",
           .value = &o.runs,
           .help = "run folders; several are laid over each other and compared with the first",
           .required = true},
          {.flag = "--out",
           .value = &o.out,
           .help = "the page; default: report.html in the run folder, of several runs beside the first of them"},
          {.flag = "--plots",
           .value = &o.plots,
           .help = "folder of plots for papers (PNG, through Python's matplotlib); default: plots beside the page, of "
                   "several runs report-plots"},
          {.flag = "--label",
           .value = &o.labels,
           .help = "what the page calls a run; once for each, in their order; default: what telesplat run --label "
                   "called it, else its folder's name"},
          {.flag = "--skip",
           .value = &o.skip_s,
           .help = "seconds after the first displayed frame of each run that are left out: its warming up",
           .limits = options::Range{0.0, 1e6}},
          {.flag = "--no-plots", .value = &o.no_plots, .help = "draw no plots for papers"}};
}

int report(ReportOptions o, const options::Given&) {
  net::install_signal_handlers();
  log::initialise("telesplat", "warn");
  const auto settled = settle_report(std::move(o));
  if (!settled) return tools::complain(settled.error());
  tools::ProgressLine progress(1);
  const auto made = make_report(*settled, progress, net::stop_requested);
  progress.close();
  if (!made) return tools::complain(made.error(), 1);
  if (made->interrupted || net::stop_requested()) {
    tools::complain({made->interrupted ? "interrupted; no report was made" : "interrupted; there are no plots"});
    return kInterrupted;
  }
  for (const auto& line : lines_of(*made)) std::printf("%s\n", line.c_str());
  return 0;
}

}  // namespace

Command report_command() {
  return make_command("report", "make a page (HTML, in one file) about recorded runs: what they measured, and when",
                      table, report);
}

}  // namespace telesplat::launcher
