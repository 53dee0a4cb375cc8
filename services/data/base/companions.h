// Files that a data file names: material libraries, pictures, buffers, pieces.
#pragma once

#include <string>
#include <string_view>

#include "common/core/result.h"

namespace telesplat::data {

/// Gives readers the files that the file they read names, wherever these come from.
class Companions {
 public:
  virtual ~Companions() = default;
  /// The content of a file, by its name as it stands in the data file: relative to that file's folder. It stays valid
  /// as long as this object. Error: there is no such file, or it may not be read; the text names it.
  virtual Result<std::string_view> read(const std::string& named) = 0;
};

}  // namespace telesplat::data
