#include "tools/telesplat/run/after_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "client/viewer/record/frame_spool.h"
#include "common/core/machine.h"
#include "common/metrics/run_folder.h"
#include "common/net/service.h"
#include "common/options/complain.h"
#include "tools/common/json_file.h"
#include "tools/telesplat/report/report.h"
#include "tools/telesplat/run/run_report.h"
#include "tools/telesplat/run/verify.h"
#include "tools/telesplat/run/wall.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

}  // namespace

void AfterRun::develop_pictures() {
  std::error_code error;
  for (int i = 1; i <= o_.viewers; ++i) {
    const std::string folder = viewer_directory(o_.out, i), spool = folder + "/spool";
    if (!fs::is_directory(spool, error)) continue;
    const auto tell = [&](size_t done, size_t of) { progress_.show(fmt::format("picture {} of {}", done, of)); };
    const auto go_on = [] { return !net::stop_requested(); };
    if (const Status s = viewer::develop_frames(spool, folder + "/images", tell, go_on); !s) {
      progress_.line("telesplat: " + s.error().text);
      developed_ = false;
    }
    if (fs::is_empty(spool, error)) fs::remove(spool, error);
    progress_.close();
  }
}

// A joined session leaves no summary here, but its first displayed frame is always recorded as a picture.
bool AfterRun::displayed() const {
  if (!o_.join_master.empty()) {
    const auto files = metrics::recorded_files(o_.out);
    return std::any_of(files.begin(), files.end(), [](const auto& f) { return f.find("frame") != f.npos; });
  }
  const auto summary = tools::read_json_file(o_.out + "/summary.json");
  return summary.is_object() && summary.value("frames", uint64_t{0}) > 0;
}

int AfterRun::run(bool stopped, const std::string& master_folder) {
  if (const int code = verify(stopped)) return code;
  if (o_.join_master.empty())
    print_report(o_.out);
  else
    print_joined(o_.out, master_folder);
  if (const int code = stitch(stopped)) return code;
  const int movie = make_the_movie(stopped);
  if (movie == kInterrupted) return movie;
  // The report is made even if the movie failed.
  const int report = make_the_report(stopped);
  return movie ? movie : report;
}

int AfterRun::tell_unseen(bool stopped) const {
  const auto summary = tools::read_json_file(o_.out + "/summary.json");
  std::vector<std::string> unseen;
  const auto viewers = summary.is_object() ? summary.value("by_viewer", nlohmann::json::object()) : nlohmann::json();
  for (const auto& [name, figures] : viewers.items())
    if (figures.value("frames_of_views", uint64_t{1}) == 0) unseen.push_back(name);
  if (unseen.empty()) return 0;
  const bool none = unseen.size() == viewers.size();
  constexpr size_t kNamed = 5;
  const std::string names =
      fmt::format("{}{}", fmt::join(unseen.begin(), unseen.begin() + std::min(kNamed, unseen.size()), ", "),
                  unseen.size() > kNamed ? ", ..." : "");
  complain({fmt::format(
      "{}; it takes more time (--duration), or fewer viewers and pixels",
      none ? "no frame shows the data: the run ended before a view was complete"
           : fmt::format("{} of {} viewers never showed a complete view: {}", unseen.size(), viewers.size(), names))});
  return none && !stopped ? 1 : 0;
}

int AfterRun::verify(bool stopped) {
  if (o_.viewer.display.kept.verify_every == 0) return 0;
  if (!o_.join_master.empty()) {
    progress_.line("frames of a joined session are not verified: its data are with its data server");
    drop_spools();
    return 0;
  }
  if (stopped) progress_.line("what was displayed is verified; Ctrl-C leaves that out");
  // Uses the open scene, with its epochs from the record: session.toml does not hold every file's name.
  if (const Status s = scene_->read_record(o_.out); !s) return complain(s.error());
  auto direct = scene_->open_direct(0, [](const char*, double) {});
  if (!direct) return complain(direct.error());
  const auto tell = [&](size_t done, size_t of) { progress_.show(fmt::format("verifying view {} of {}", done, of)); };
  const VerifyOptions options{o_.viewer.display.shading, o_.verify_samples};
  const Status verified = verify_run(o_.out, **direct, options, tell, net::stop_requested);
  progress_.close();
  return verified ? 0 : complain(verified.error(), 1);
}

// Makes the wall's picture, and prints its tiles' moments. A run that was stopped may lack some tiles.
int AfterRun::stitch(bool stopped) const {
  if (const Status s = keep_barrier(o_.out, o_.viewer.stereo.panel_file); !s) return complain(s.error(), 1);
  if (o_.viewer.wall.name.empty()) return 0;
  if (const Status s = keep_description(o_.out, o_.viewer.wall.name); !s) return complain(s.error(), 1);
  const auto tiles = stitch_wall(o_.out, o_.viewer.display.wall);
  if (!tiles) return complain(tiles.error(), stopped ? 0 : 1);
  std::string moments;
  for (const auto& t : *tiles)
    moments += fmt::format("{}{} frame {} at {:.2f} s", moments.empty() ? "" : ", ", t.viewer, t.frame, t.t_s);
  std::printf("The wall's picture is images/wall.png, of %s\n", moments.c_str());
  return 0;
}

// A user who stops the run does not want to wait for a movie; Ctrl-C interrupts the movie, too.
int AfterRun::make_the_movie(bool stopped) {
  if (!movie_) return 0;
  const std::string& file = movie_->options.file;
  const std::string later = fmt::format("telesplat movie {} makes it of the record", shell_line({o_.out, file}));
  if (stopped || net::stop_requested()) {
    progress_.line(fmt::format("{} was not made; {}", file, later));
    return 0;
  }
  const auto report = make_movie(o_.out, *movie_, progress_, net::stop_requested);
  if (!report) return complain(report.error(), 1);
  if (!report->written) return complain(report->written.error(), 1);
  for (const auto& line : report->lines) std::printf("%s\n", line.c_str());
  if (report->interrupted) progress_.line(fmt::format("interrupted: {} was not made; {}", file, later));
  return report->interrupted ? kInterrupted : report->instead ? 1 : 0;
}

int AfterRun::make_the_report(bool stopped) {
  if (!o_.report) return 0;
  const std::string later = fmt::format("telesplat report {} makes it", shell_line({o_.out}));
  if (stopped || net::stop_requested()) {
    progress_.line(fmt::format("the report was not made; {}", later));
    return 0;
  }
  ReportOptions options;
  options.runs = {o_.out};
  const auto settled = settle_report(std::move(options));
  if (!settled) return complain(settled.error(), 1);
  const auto made = make_report(*settled, progress_, net::stop_requested);
  progress_.close();
  if (!made) return complain(made.error(), 1);
  if (made->interrupted) {
    progress_.line(fmt::format("interrupted: the report was not made; {}", later));
    return kInterrupted;
  }
  std::printf("%s\n", line_of(*made).c_str());
  return 0;
}

void AfterRun::drop_spools() const {
  if (!developed_) return;  // they may show why developing failed
  std::error_code error;
  for (int i = 1; i <= o_.viewers; ++i) {
    const std::string spool = viewer_directory(o_.out, i) + "/spool";
    for (const auto& frame : viewer::spooled_frames(spool)) fs::remove(frame, error);
    fs::remove(spool, error);
  }
}

}  // namespace telesplat::launcher
