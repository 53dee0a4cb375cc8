// Folders whose files are the time steps, or the slices, of one data set.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::data {

/// Regular files of a folder that are not hidden, by name; of `levels` of folders. Error: it cannot be read, or has
/// more than 100,000.
Result<std::vector<std::string>> files_of_folder(const std::string& folder, int levels = 1);

/// The one numbered series that `paths` are, in order of the number in which their names differ; a lone file is one,
/// too. Error, naming the folder: they are none; two have the same number.
Result<std::vector<std::string>> numbered_series(const std::vector<std::string>& paths, const std::string& folder);

}  // namespace telesplat::data
