// The tables of a run folder, as far as they are there.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/telesplat/report/reading/loose_table.h"

namespace telesplat::launcher {

/// What a report reads of the tables. A table that is not there, or has no rows, is not there; `notes` say so.
struct RunTables {
  std::optional<LooseTable> frames, updates, tiles, quality, stages;
  bool slices = false;             ///< a volume's frames, so that some columns mean other things (docs/metrics.md)
  double origin_s = 0;             ///< begin of the first displayed frame, since the run's beginning
  double end_s = 0;                ///< of the last one
  std::vector<double> frame_s;     ///< begin of each row of frames, since origin_s
  std::vector<char> drawn;         ///< whether each row of frames is of a frame that was drawn
  std::vector<std::string> notes;  ///< one line each: what is missing or damaged, and what the page lacks for it

  bool has_frames() const { return frames.has_value(); }
  double duration_s() const { return end_s - origin_s; }
  /// The time that frames took for which nothing was drawn.
  double still_s() const;
  /// A column of frames, NaN where nothing was drawn, or what is measured has no such value.
  std::vector<double> of_drawn(const std::string& column) const;
};

/// What bounds a page.
struct PageLimits {
  size_t buckets = 2000;           ///< of a series over time: twice as many points
  size_t stacked_updates = 1500;   ///< bars of the stages
  size_t poses = 1500;             ///< of the map
  size_t pictures = 10;            ///< of each run, and three that compare
  size_t picture_bytes = 6 << 20;  ///< of all runs together
  size_t text_bytes = 200'000;     ///< of a configuration
};

/// Whether a file or folder of a run is reached without a symbolic link: the run may be a stranger's, and a link may
/// lead to any file of the reader's.
bool lies_within(const std::string& directory, const std::string& name);

/// kind: of the scene, "mesh", "julia", "volume" or empty.
/// skip_s: what began sooner after the first displayed frame is left out.
RunTables read_run_tables(const std::string& directory, const std::string& kind, double skip_s = 0);

}  // namespace telesplat::launcher
