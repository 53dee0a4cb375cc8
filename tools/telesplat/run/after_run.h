// What is made of a run's record once its processes are gone, step by step: pictures, the comparison with direct
// rendering, the figures, the wall's picture, the movie, the report.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "tools/common/progress_line.h"
#include "tools/telesplat/movie/movie.h"
#include "tools/telesplat/run/run_options.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {

/// A signal that comes while a step works (net::stop_requested) ends that step, and those that take long after it.
class AfterRun {
 public:
  /// movie: what is to be made of the record, if anything. All are used as long as this lives. scene: null where a
  /// session was joined.
  AfterRun(const RunOptions& options, Scene* scene, const std::optional<MoviePlan>& movie,
           tools::ProgressLine& progress)
      : o_(options), scene_(scene), movie_(movie), progress_(progress) {}

  /// Recorded frames become pictures, whatever made their viewer stop before they were.
  void develop_pictures();
  /// Whether anything was displayed.
  bool displayed() const;
  /// All that follows. stopped: the run was, before its end. master_folder: of a joined session, if it is known. Exit
  /// code: 0, 1 something went wrong, 2 the data cannot be read any more, 130 a signal came.
  int run(bool stopped, const std::string& master_folder);
  /// Tells which viewers showed no complete view of the data. Exit code: 1 where none did, though the run lasted to its
  /// end.
  int tell_unseen(bool stopped) const;
  /// Raw frames that no step will need any more.
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
