// `telesplat movie RUN FILE`: a movie, pictures or a contact sheet of the frames that a finished run displayed.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "common/core/log.h"
#include "common/net/service.h"
#include "common/options/complain.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/movie/movie.h"

namespace telesplat::launcher {
namespace {

struct MovieCommandOptions {
  std::string run;
  MovieOptions movie;
};

options::Table table(MovieCommandOptions& o) {
  const options::Table places{
      {.flag = "run", .value = &o.run, .help = "run folder", .required = true},
      {.flag = "file",
       .value = &o.movie.file,
       .help =
           "FILE.mp4, .m4v, .mov, .mkv, .avi, .webm or .gif for a movie, through ffmpeg; folder/ or folder/%06d.png "
           "for pictures; FILE.png for a contact sheet",
       .required = true}};
  return joined(places, movie_table(o.movie));
}

int movie(MovieCommandOptions o, const options::Given&) {
  net::install_signal_handlers();
  log::initialise("telesplat", "warn");
  std::error_code error;
  if (!std::filesystem::is_directory(o.run, error)) return complain({fmt::format("{}: is no run folder", o.run)});
  const auto plan = plan_movie(o.movie, "--size");
  if (!plan) return complain(plan.error());
  tools::ProgressLine progress;
  const auto report = make_movie(o.run, *plan, progress, net::stop_requested);
  if (!report) return complain(report.error());
  if (report->interrupted) return complain({fmt::format("interrupted; {} was not made", o.movie.file)}, kInterrupted);
  if (!report->written) return complain(report->written.error(), 1);
  for (const auto& line : report->lines) std::printf("%s\n", line.c_str());
  return report->instead ? 1 : 0;
}

}  // namespace

Command movie_command() {
  return make_command("movie", "make a movie, pictures or a contact sheet of the frames that a run displayed", table,
                      movie);
}

}  // namespace telesplat::launcher
