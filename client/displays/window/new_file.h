// Names of files that a window writes.
#pragma once

#include <string>

namespace telesplat::viewer {

/// FOLDER/WHAT-DATE-TIME.ENDING, a name that no file has. Makes the folder; where that fails, writing will.
std::string new_file(const std::string& folder, const std::string& what, const std::string& ending);

}  // namespace telesplat::viewer
