// A movie of a recorded run: at each of its moments the frame that was displayed then, made again from the record.
#pragma once

#include <string>
#include <vector>

#include "tools/common/progress_line.h"
#include "tools/telesplat/movie/movie_target.h"

namespace telesplat::launcher {

/// Exit code of a movie that Ctrl-C ended.
inline constexpr int kInterrupted = 130;

/// What is asked for, found possible.
struct MoviePlan {
  MovieOptions options;
  MovieTarget target;
  int width = 0, height = 0;  ///< 0: the display's
  const char* size_flag = "--size";
};
/// To be called before a run begins: refuses what can be refused. Error: names the file or `size_flag`.
Result<MoviePlan> plan_movie(const MovieOptions& options, const char* size_flag);

struct MovieReport {
  std::vector<std::string> lines;  ///< for the person: what was made, and what it is short of
  bool instead = false;            ///< there are pictures in place of the movie, since ffmpeg is not installed
  bool interrupted = false;        ///< should_stop said so: nothing was made
  Status written = ok_status();    ///< what went wrong with writing it, if anything: nothing was made
};
/// Makes it of the run in this folder. Error: what is wrong with the record.
Result<MovieReport> make_movie(const std::string& run_directory, const MoviePlan& plan, tools::ProgressLine& progress,
                               const tools::ShouldStop& should_stop);

}  // namespace telesplat::launcher
