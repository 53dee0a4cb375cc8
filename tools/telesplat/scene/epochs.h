// Reads the epochs of a run's record: epochs.csv.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/core/ids.h"
#include "common/geometry/clip.h"
#include "tools/common/csv_table.h"

namespace telesplat::launcher {

/// The error that epochs.csv lacks this epoch.
Error no_epoch(const std::string& run_directory, EpochId epoch, uint64_t first, uint64_t last);

/// The content of each epoch.
template <class T>
struct Epochs {
  std::string directory;  ///< the run's folder
  std::map<uint64_t, T> by_id;
  std::map<uint64_t, geometry::Clip> clips;  ///< clips of epochs that had one

  /// Error: epochs.csv has no such epoch.
  Result<T> at(EpochId epoch) const {
    const auto found = by_id.find(epoch.value);
    if (found != by_id.end()) return found->second;
    return by_id.empty() ? no_epoch(directory, epoch, 0, 0)
                         : no_epoch(directory, epoch, by_id.begin()->first, by_id.rbegin()->first);
  }
  /// without: the value for a run without epochs.csv.
  Result<T> at(EpochId epoch, const T& without) const { return by_id.empty() ? without : at(epoch); }
  geometry::Clip clip_at(EpochId epoch) const {
    const auto found = clips.find(epoch.value);
    return found == clips.end() ? geometry::Clip() : found->second;
  }
};

/// Calls read(epoch, row) for each row of the run's epochs.csv, if there is one. Error: the table lacks one of
/// `columns`, or read() returns one or finds something wrong with the row; names file and line.
Status read_epochs(const std::string& run_directory, const std::vector<const char*>& columns,
                   const std::function<Status(uint64_t, tools::CsvRow&)>& read);

/// Reads column "clip" of an epoch's row.
void read_clip(uint64_t epoch, tools::CsvRow& row, std::map<uint64_t, geometry::Clip>& clips);

}  // namespace telesplat::launcher
