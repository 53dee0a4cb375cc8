// Steps that follow once a run's processes have ended: pictures, the comparison with direct rendering, the figures, the
// wall's picture, the movie, the report.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "tools/common/progress_line.h"
#include "tools/telesplat/movie/movie.h"
#include "tools/telesplat/run/run_options.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {

/// A signal (net::stop_requested) ends the step that runs, and skips later ones that take long.
class AfterRun {
 public:
  /// movie: the movie to make, if any. All arguments must outlive this. scene: null if a session was joined.
  AfterRun(const RunOptions& options, Scene* scene, const std::optional<MoviePlan>& movie,
           tools::ProgressLine& progress)
      : o_(options), scene_(scene), movie_(movie), progress_(progress) {}

  /// Makes pictures of recorded frames that the viewer left raw when it ended.
  void develop_pictures();
  /// True if any frame was displayed.
  bool displayed() const;
  /// Runs all later steps. stopped: a signal ended the run early. master_folder: a joined session's, if known. Exit
  /// code: 0, 1 a step failed, 2 the data cannot be read any more, 130 a signal came.
  int run(bool stopped, const std::string& master_folder);
  /// Prints which viewers showed no complete view of the data. Exit code: 1 if no viewer did, though the run lasted to
  /// its end.
  int tell_unseen(bool stopped) const;
  /// Deletes raw frames that no later step needs.
  void drop_spools() const;

 private:
  int verify(bool stopped);
  int stitch(bool stopped) const;
  int make_the_movie(bool stopped);
  int make_the_report(bool stopped);

  const RunOptions& o_;
  Scene* const scene_;
  const std::optional<MoviePlan>& movie_;
  tools::ProgressLine& progress_;
  bool developed_ = true;  // every picture was made
};

}  // namespace telesplat::launcher
