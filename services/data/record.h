// A data server's part of a run's record: its scene, and its files with their content's hash.
#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <thread>

#include "common/core/file_hash.h"
#include "services/data/data_options.h"
#include "services/data/served.h"

namespace telesplat::data {

/// Returns the table [scene] of session.toml for a data set given by file and flags: the launcher makes the same scene
/// from it again.
std::string scene_lines(const DataOptions& options, scene::Kind kind);
/// Returns the tables of session.toml for an open scene: its own, or scene_lines().
std::string record_of(const DataOptions& options, const Served& served);

/// Returns the files that hold the data, in order of reading; for a folder, the files in it; empty for a Julia set.
std::vector<std::string> files_of(const DataOptions& options, scene::Kind kind);

/// Hashes files in a thread of low priority, so that a session need not wait for it.
class BackgroundHash {
 public:
  explicit BackgroundHash(std::vector<std::string> files);
  ~BackgroundHash();  ///< cancels unfinished hashing

  /// Returns the hash once, when it is known. nullopt: before, after, and if a file cannot be read.
  std::optional<FileHash> take();

 private:
  std::optional<FileHash> hash_;
  std::atomic<bool> done_{false}, stop_{false};
  std::thread thread_;  // last, because it uses the others
};

}  // namespace telesplat::data
