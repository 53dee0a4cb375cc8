// The folder where processes of one user on one machine leave small files for each other. Files of other users, files
// that are too large and those that are not plain are not read.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::net {

class RuntimeFolder {
 public:
  /// Folders that it may be, the best first: $TELESPLAT_RUNTIME alone if that is set; else $XDG_RUNTIME_DIR/telesplat,
  /// and telesplat-UID in the folder for temporary files. Readers look into all of them: a process that was started
  /// elsewhere may have another environment.
  static std::vector<std::string> candidates();

  /// make: creates it if it does not exist, for the user alone. Error: it does not exist, is no folder or a link,
  /// belongs to another user, or others may write into it.
  static Result<RuntimeFolder> open(const std::string& path, bool make);
  /// Makes and opens the first candidate that can be used. Error: the last candidate's.
  static Result<RuntimeFolder> make();

  ~RuntimeFolder();
  RuntimeFolder(RuntimeFolder&& other) noexcept;
  RuntimeFolder& operator=(RuntimeFolder&&) = delete;

  const std::string& path() const { return path_; }
  /// Replaces a file: readers see the whole text or the old one.
  Status write(const std::string& name, const std::string& text) const;
  /// Writes a new file in the same way. Error: it exists already.
  Status create(const std::string& name, const std::string& text) const;
  void remove(const std::string& name) const;
  /// Names of the files, unsorted, at most 1000.
  std::vector<std::string> names() const;
  /// nullopt: not a plain file of this user, or larger than `most_bytes`.
  std::optional<std::string> read(const std::string& name, size_t most_bytes) const;

 private:
  RuntimeFolder(std::string path, int fd) : path_(std::move(path)), fd_(fd) {}
  enum class Place { kReplaces, kIsNew };
  Status put(const std::string& name, const std::string& text, Place place) const;

  std::string path_;
  int fd_;
};

}  // namespace telesplat::net
