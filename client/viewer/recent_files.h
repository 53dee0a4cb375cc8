// Data sets that were opened of late, newest first: a text file, a path a line.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::viewer {

inline constexpr size_t kMostRecent = 12;

/// $XDG_CONFIG_HOME/telesplat/recent, else ~/.config/telesplat/recent; empty: there is no home.
std::string recent_files_path();
/// At most kMostRecent; none where the file is not there or is no text of this kind.
std::vector<std::string> read_recent(const std::string& list);
/// Puts a data set first. Its path becomes absolute; what is no path of a file or folder, such as "julia", stays. The
/// file appears whole or not at all. Error: names the file.
Status add_recent(const std::string& list, const std::string& data_set);

}  // namespace telesplat::viewer
