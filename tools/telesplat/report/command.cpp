// `telesplat report DIR [DIR...]`: a page about recorded runs, one or several beside each other.
#include <cstdio>

#include "common/core/log.h"
#include "common/net/service.h"
#include "common/options/complain.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/movie/movie.h"
#include "tools/telesplat/report/report.h"

namespace telesplat::launcher {
namespace {

options::Table table(ReportOptions& o) {
  return {
      {.flag = "runs",
       .value = &o.runs,
       .help = "run folders; several are laid over each other and compared with the first; or the folder of one sweep",
       .required = true},
      {.flag = "--out",
       .value = &o.out,
       .help = "the page; default: report.html in the run folder, of several runs beside the first of them"},
      {.flag = "--label",
       .value = &o.labels,
       .help = "what the page calls a run; once for each, in their order; default: what telesplat run --label "
               "called it, else its folder's name"},
      {.flag = "--skip",
       .value = &o.skip_s,
       .help = "seconds after the first displayed frame of each run that are left out: its warming up",
       .limits = options::Range{0.0, 1e6}}};
}

int report(ReportOptions o, const options::Given&) {
  net::install_signal_handlers();
  log::initialise("telesplat", "warn");
  const auto settled = settle_report(std::move(o));
  if (!settled) return complain(settled.error());
  tools::ProgressLine progress(1);
  const auto made = make_report(*settled, progress, net::stop_requested);
  progress.close();
  if (!made) return complain(made.error(), 1);
  if (made->interrupted) return complain({"interrupted; no report was made"}, kInterrupted);
  std::printf("%s\n", line_of(*made).c_str());
  return 0;
}

}  // namespace

Command report_command() {
  return make_command("report",
                      "make a page (HTML, in one file) about recorded runs or a sweep: what they measured, and when",
                      table, report);
}

}  // namespace telesplat::launcher
