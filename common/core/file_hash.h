// A hash of the content of files, for records of the data that a run read.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat {

struct FileHash {
  uint64_t bytes = 0;  ///< size of all files together
  uint64_t hash = 0;   ///< XXH3-64 of their bytes, one file after the other, as `cat FILES | xxhsum -H3` prints it
};

/// The hash as records write it: "xxh3:0123456789abcdef".
std::string hash_text(uint64_t hash);

/// Reads the files in this order. go_on: asked after every MiB; if it returns false, hash_of_files returns an error.
/// Error: names the file that cannot be read.
Result<FileHash> hash_of_files(const std::vector<std::string>& paths, const std::function<bool()>& go_on = {});

}  // namespace telesplat
