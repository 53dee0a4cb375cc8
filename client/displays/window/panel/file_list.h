// What is in a folder, read in the background: a file system that does not answer holds up nobody.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace telesplat::viewer {

class FileList {
 public:
  static constexpr size_t kMost = 4000;  ///< entries; the rest is left out

  struct Entry {
    std::string name;
    bool folder = false;
    uint64_t bytes = 0;
    bool operator==(const Entry&) const = default;
  };
  struct Listing {
    std::string folder;               ///< absolute
    std::vector<Entry> entries;       ///< folders first, each by name; nothing whose name begins with a dot
    bool whole = true;                ///< false: there are more
    std::string problem;              ///< why it cannot be read
    std::vector<std::string> recent;  ///< read_recent() of then
  };

  /// Reads this folder; what was asked for before is forgotten. "" is the current folder.
  void go(const std::string& folder);
  /// The folder that was read last; null before the first.
  std::shared_ptr<const Listing> listing() const;
  /// Whether one is being read.
  bool busy() const;

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

/// Reads a folder, in this thread. Error in Listing::problem.
FileList::Listing read_folder(const std::string& folder);

}  // namespace telesplat::viewer
