// The tables of a run folder, as far as they are there.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::launcher {

/// Columns of a table, by name. Lines that cannot be read (tools::CsvTable), or have more than 64 KiB, are left out.
class LooseTable {
 public:
  /// The columns that are asked for, as far as the file has them. Error: as of tools::CsvTable.
  static Result<LooseTable> read(const std::string& path, const std::vector<std::string>& numbers,
                                 const std::vector<std::string>& texts = {});

  size_t rows() const { return rows_; }
  size_t damaged() const { return damaged_; }  ///< lines that were left out
  bool has(std::string_view name) const;
  /// A value a row, within 1e12 of 0; NaN where there is no such number. All NaN if the file has no such column.
  const std::vector<double>& numbers(const std::string& name) const;
  /// Valid UTF-8, at most 200 bytes each; empty if the file has no such column.
  const std::vector<std::string>& texts(const std::string& name) const;
  /// Leaves out the rows whose value in this column, which was asked for, is less.
  void leave_out_below(const std::string& column, double least);

 private:
  size_t rows_ = 0, damaged_ = 0;
  std::vector<std::string> header_;
  std::map<std::string, std::vector<double>, std::less<>> numbers_;
  std::map<std::string, std::vector<std::string>, std::less<>> texts_;
};

/// A stage of a view update.
struct UpdateStage {
  const char* column;  ///< in stages.csv
  const char* label;   ///< for people
};

/// In their order.
inline constexpr UpdateStage kUpdateStages[] = {
    {"request_network_ms", "request travels"},
    {"view_queue_ms", "request waits at the master"},
    {"plan_ms", "plan"},
    {"lease_queue_ms", "waits for a sampler"},
    {"lease_network_ms", "lease travels"},
    {"sampler_queue_ms", "waits in the sampler"},
    {"fetch_ms", "sampler fetches data"},
    {"sampling_ms", "sampling"},
    {"encoding_ms", "encoding"},
    {"tile_network_ms", "tile travels"},
    {"packer_queue_ms", "waits at the packer"},
    {"packing_ms", "packing"},
    {"publishing_ms", "publishing"},
    {"patch_network_ms", "patch travels"},
    {"viewer_queue_ms", "waits in the viewer"},
    {"decoding_ms", "decoding"},
    {"insertion_ms", "insertion"},
};

/// "network", "queue" or "work", as the column's name ends.
constexpr const char* stage_group(std::string_view column) {
  return column.ends_with("_network_ms") ? "network" : column.ends_with("_queue_ms") ? "queue" : "work";
}

/// What a report reads of the tables. A table that is not there, or has no rows, is not there; `notes` say so.
struct RunTables {
  std::optional<LooseTable> frames, updates, tiles, quality, stages;
  bool slices = false;             ///< a volume's frames, so that some columns mean other things (docs/metrics.md)
  double origin_s = 0;             ///< begin of the first displayed frame, since the run's beginning
  double end_s = 0;                ///< of the last one
  std::vector<double> frame_s;     ///< begin of each row of frames, since origin_s
  std::vector<char> drawn;         ///< whether each row of frames is of a frame that was drawn
  std::vector<std::string> notes;  ///< one line each: what is missing or damaged, and what the page lacks for it

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
