// What a data server tells the record of a run: which scene it was, and which files with which content.
#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <thread>

#include "common/core/file_hash.h"
#include "services/data/data_options.h"
#include "services/data/served.h"

namespace telesplat::data {

/// The table [scene] of session.toml for a data set that its file and its flags tell: the launcher makes the same scene
/// from it again.
std::string scene_lines(const DataOptions& options, scene::Kind kind);
/// The tables of session.toml that tell an open scene: its own, or scene_lines().
std::string record_of(const DataOptions& options, const Served& served);

/// The files that hold the data, in the order in which they are read; of a folder those in it. None: of a Julia set.
std::vector<std::string> files_of(const DataOptions& options, scene::Kind kind);

/// Hashes files in a thread of low priority, so that a session need not wait for it.
class BackgroundHash {
 public:
  explicit BackgroundHash(std::vector<std::string> files);
  ~BackgroundHash();  ///< gives up, if it is not done

  /// Once: when the hash is there. Nothing before, after, and if a file cannot be read.
  std::optional<FileHash> take();

 private:
  std::optional<FileHash> hash_;
  std::atomic<bool> done_{false}, stop_{false};
  std::thread thread_;  // last: it uses the others
};

}  // namespace telesplat::data
