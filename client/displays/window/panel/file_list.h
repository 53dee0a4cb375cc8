// Lists a folder in the background: if its file system does not answer, the window goes on.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace telesplat::viewer {

class FileList {
 public:
  static constexpr size_t kMost = 4000;  ///< entries; further ones are omitted

  struct Entry {
    std::string name;
    bool folder = false;
    uint64_t bytes = 0;
    bool operator==(const Entry&) const = default;
  };
  struct Listing {
    std::string folder;               ///< absolute
    std::vector<Entry> entries;       ///< folders first, each by name; without names that begin with a dot
    bool whole = true;                ///< false: there are more entries
    std::string problem;              ///< reason why it cannot be read
    std::vector<std::string> recent;  ///< read_recent() at that time
  };

  /// Reads this folder; an earlier folder that is not read yet is dropped. "" is the current folder.
  void go(const std::string& folder);
  /// The folder read last; null before the first.
  std::shared_ptr<const Listing> listing() const;
  /// True while a folder is being read.
  bool busy() const;

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

/// Reads a folder in this thread. Listing::problem has the error.
FileList::Listing read_folder(const std::string& folder);

}  // namespace telesplat::viewer
