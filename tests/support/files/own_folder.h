// A folder for the files of a test program. Test programs run at the same time, so no two may share names.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace telesplat::tests {

/// Returns the path, with a slash at its end, of a folder of this process; the end of the process deletes it.
inline const std::string& own_folder() {
  struct Folder {
    Folder() : path((std::filesystem::temp_directory_path() / "telesplat-test-XXXXXX").string()) {
      if (!mkdtemp(path.data())) std::abort();
      path += '/';
    }
    ~Folder() {
      std::error_code error;
      std::filesystem::remove_all(path, error);
    }
    std::string path;
  };
  static const Folder folder;
  return folder.path;
}

}  // namespace telesplat::tests
