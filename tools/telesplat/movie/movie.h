// A movie of a recorded run: each of its frames is the one displayed at that moment, drawn again from the record.
#pragma once

#include <string>
#include <vector>

#include "tools/common/progress_line.h"
#include "tools/telesplat/movie/movie_target.h"

namespace telesplat::launcher {

/// Exit code of a movie that Ctrl-C ended.
inline constexpr int kInterrupted = 130;

/// A movie that was asked for and can be made.
struct MoviePlan {
  MovieOptions options;
  MovieTarget target;
  int width = 0, height = 0;  ///< 0: the display's
  const char* size_flag = "--size";
};
/// Refuses what can be refused before the run begins: call it then. Error: names the file or `size_flag`.
Result<MoviePlan> plan_movie(const MovieOptions& options, const char* size_flag);

struct MovieReport {
  std::vector<std::string> lines;  ///< for the person: files that were made, and what they lack
  bool instead = false;            ///< pictures were made in place of the movie, since ffmpeg is not installed
  bool interrupted = false;        ///< should_stop returned true: nothing was made
  Status written = ok_status();    ///< an error of writing: nothing was made
};
/// Makes the movie of the run in this folder. Error: says what is wrong with the record.
Result<MovieReport> make_movie(const std::string& run_directory, const MoviePlan& plan, tools::ProgressLine& progress,
                               const tools::ShouldStop& should_stop);

}  // namespace telesplat::launcher
