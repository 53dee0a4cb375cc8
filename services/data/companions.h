// Files that a data set's files name, such as the voxels of a detached header. Whoever wrote such a file chose the
// names: a server that hands out what they lead to would hand out any file that it can read.
#pragma once

#include "common/core/result.h"
#include "services/data/data_options.h"

namespace telesplat::data {

/// Refuses files that lie elsewhere than below the folder of the file that names them, links followed, unless
/// options.companions is "anywhere". What is missing, or cannot be read, is for its reader to tell. Error: which file
/// names which.
Status check_companions(const DataOptions& options);

}  // namespace telesplat::data
