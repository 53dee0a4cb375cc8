// TOML files: scenes, and what a run tells of itself.
#pragma once

#include <toml++/toml.h>
#include <cstdint>
#include <string>

#include "common/core/result.h"

namespace telesplat::launcher {

/// Error: the file cannot be read, is no regular file, has more than `most_bytes`, or is no TOML: then file and line.
Result<toml::table> read_toml(const std::string& path, uint64_t most_bytes);

}  // namespace telesplat::launcher
