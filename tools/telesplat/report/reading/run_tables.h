// Reads the tables of a run folder, as far as it has them.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::launcher {

/// Columns of a table, by name. Leaves out lines that cannot be read (tools::CsvTable) or have more than 64 KiB.
class LooseTable {
 public:
  /// Reads the named columns, as far as the file has them. Errors: those of tools::CsvTable.
  static Result<LooseTable> read(const std::string& path, const std::vector<std::string>& numbers,
                                 const std::vector<std::string>& texts = {});

  size_t rows() const { return rows_; }
  size_t damaged() const { return damaged_; }  ///< lines that were left out
  bool has(std::string_view name) const;
  /// One value a row, within 1e12 of 0; NaN if the cell has no such number. All NaN if the file has no such column.
  const std::vector<double>& numbers(const std::string& name) const;
  /// Valid UTF-8, at most 200 bytes each; empty if the file has no such column.
  const std::vector<std::string>& texts(const std::string& name) const;
  /// Leaves out the rows whose value in `column` is below `least`. Precondition: read() read that column.
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

/// "network", "queue" or "work", by the end of the column's name.
constexpr const char* stage_group(std::string_view column) {
  return column.ends_with("_network_ms") ? "network" : column.ends_with("_queue_ms") ? "queue" : "work";
}

/// The tables that a report reads. A missing or empty table is nullopt; `notes` say so.
struct RunTables {
  std::optional<LooseTable> frames, updates, tiles, quality, stages;
  bool slices = false;             ///< frames of a volume: some columns mean other things (docs/metrics.md)
  double origin_s = 0;             ///< begin of the first displayed frame, since the run's beginning
  double end_s = 0;                ///< end of the last displayed frame, since the run's beginning
  std::vector<double> frame_s;     ///< begin of each row of frames, since origin_s
  std::vector<char> drawn;         ///< 1 if the row's frame was drawn
  std::vector<std::string> notes;  ///< one line each: what is missing or damaged, and what the page lacks for it

  double duration_s() const { return end_s - origin_s; }
  /// Sum of the delays of frames that were not drawn.
  double still_s() const;
  /// Returns a column of frames; NaN if the frame was not drawn, or has no such value.
  std::vector<double> of_drawn(const std::string& column) const;
};

/// Limits of a page.
struct PageLimits {
  size_t buckets = 2000;           ///< time steps of a series; it has at most twice as many points
  size_t stacked_updates = 1500;   ///< bars of the stages
  size_t poses = 1500;             ///< poses of the map
  size_t pictures = 10;            ///< pictures of each run, and three that compare
  size_t picture_bytes = 6 << 20;  ///< for the pictures of all runs together
  size_t text_bytes = 200'000;     ///< for a configuration
};

/// True if no symbolic link leads to a file or folder of a run: the run may be a stranger's, and a link may lead to any
/// file of the reader's.
bool lies_within(const std::string& directory, const std::string& name);

/// kind: the scene's, "mesh", "julia", "volume" or empty.
/// skip_s: rows that began sooner after the first displayed frame are left out.
RunTables read_run_tables(const std::string& directory, const std::string& kind, double skip_s = 0);

}  // namespace telesplat::launcher
