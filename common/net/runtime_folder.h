// The folder where processes of one user on one machine leave small files for each other. What others put there, and
// what is too large or no plain file, is not read.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::net {

class RuntimeFolder {
 public:
  /// Where it may be, the best first: $TELESPLAT_RUNTIME alone if that is set; else $XDG_RUNTIME_DIR/telesplat, and
  /// telesplat-UID in the folder for temporary files. Readers look into all of them: a process that was started
  /// elsewhere may know another environment.
  static std::vector<std::string> candidates();

  /// make: it is made, for the user alone, if it is not there. Error: it is not there, no folder or a link, of another
  /// user, or others may write into it.
  static Result<RuntimeFolder> open(const std::string& path, bool make);
  /// Makes and opens the first candidate that can be used. Error: of the last.
  static Result<RuntimeFolder> make();

  ~RuntimeFolder();
  RuntimeFolder(RuntimeFolder&& other) noexcept;
  RuntimeFolder& operator=(RuntimeFolder&&) = delete;

  const std::string& path() const { return path_; }
  /// Readers see the whole text or what was there before.
  Status write(const std::string& name, const std::string& text) const;
  /// The same of a file that must not be there yet. Error: it is.
  Status create(const std::string& name, const std::string& text) const;
  void remove(const std::string& name) const;
  /// Of files, unsorted, at most 1000.
  std::vector<std::string> names() const;
  /// nullopt: no plain file of this user, or larger than `most_bytes`.
  std::optional<std::string> read(const std::string& name, size_t most_bytes) const;

 private:
  RuntimeFolder(std::string path, int fd) : path_(std::move(path)), fd_(fd) {}
  enum class Place { kReplaces, kIsNew };
  Status put(const std::string& name, const std::string& text, Place place) const;

  std::string path_;
  int fd_;
};

}  // namespace telesplat::net
