// Files that a data file names: material libraries, pictures, buffers, pieces.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "common/core/result.h"
#include "services/data/base/mapped_file.h"

namespace telesplat::data {

/// Gives readers the files that the file they read names, wherever these come from.
class Companions {
 public:
  virtual ~Companions() = default;
  /// The content of a file, by its name as it stands in the data file: relative to that file's folder. It stays valid
  /// as long as this object. Error: there is no such file, or it may not be read; the text names it.
  virtual Result<std::string_view> read(const std::string& named) = 0;
};

/// Files on disk.
class FolderCompanions : public Companions {
 public:
  /// path: of the data file.
  explicit FolderCompanions(const std::string& path) : folder_(std::filesystem::path(path).parent_path()) {}
  Result<std::string_view> read(const std::string& named) override;

 private:
  std::filesystem::path folder_;
  std::map<std::string, std::shared_ptr<const MappedFile>> files_;
};

}  // namespace telesplat::data
