// The list of data sets that were opened lately, newest first: a text file, one path a line.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::viewer {

inline constexpr size_t kMostRecent = 12;

/// $XDG_CONFIG_HOME/telesplat/recent, else ~/.config/telesplat/recent; empty: neither variable is set.
std::string recent_files_path();
/// Reads at most kMostRecent; empty if there is no such file or it is not such a list.
std::vector<std::string> read_recent(const std::string& list);
/// Puts a data set first. A path becomes absolute; a name that is not a file or folder, such as "julia", stays. The
/// file appears whole or not at all. Error: names the file.
Status add_recent(const std::string& list, const std::string& data_set);

}  // namespace telesplat::viewer
