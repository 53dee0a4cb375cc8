// Folders whose files are the time steps, or the slices, of one data set.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::data {

/// Returns the regular, not hidden files of a folder, by name, down to `levels` levels of folders. Error: the folder
/// cannot be read, or has more than 100,000 files.
Result<std::vector<std::string>> files_of_folder(const std::string& folder, int levels = 1);

/// Returns `paths` as one numbered series, in order of the number in which their names differ; a lone file is a series,
/// too. Error, naming the folder: they are not one series, or two have the same number.
Result<std::vector<std::string>> numbered_series(const std::vector<std::string>& paths, const std::string& folder);

}  // namespace telesplat::data
