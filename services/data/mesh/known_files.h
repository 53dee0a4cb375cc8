// Remembers the content hashes of large files in the cache folder, so that the next start need not read the files.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "services/data/base/progress.h"

namespace telesplat::data {

/// Text file in the cache folder: kKnownBegin, then a line a hash. Damaged lines count for nothing; it begins anew when
/// it is full.
inline constexpr const char* kKnownFile = "content-hashes";
inline constexpr std::string_view kKnownBegin = "telesplat: content hashes of files\n";

struct HashMemory {
  std::string folder;  ///< the cache folder; empty: nothing is remembered
  /// Bytes of all files together from which on they are remembered: fewer are hashed in the time of a few seeks.
  uint64_t least_bytes = 64 << 20;
  /// Seconds since a file's last change before its hash is remembered: its clock may be as coarse.
  double settled_s = 3;
  bool never_read = false;  ///< true: the hash of files that are not known is 0
};

/// Returns hash_files(). Large files are not read if the folder knows files of the same devices, inodes, sizes and
/// times (to the nanosecond), with the same content in 64 blocks of 4096 bytes each. An unusable folder is no error.
uint64_t hash_known_files(const std::vector<std::string>& paths, const HashMemory& memory, const Progress& progress);
/// Removes the record from the folder, unless the file is foreign.
void forget_files(const std::string& folder);

}  // namespace telesplat::data
