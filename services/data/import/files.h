// telesplat-import opens no files: it receives descriptors of those that it reads from the process that started it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "services/data/base/mapped_file.h"

namespace telesplat::data {

/// Opens `paths` and sends the descriptors of regular files, each with its path, through a socket of packets. Stops if
/// the other end is closed.
void send_files(int socket, const std::vector<std::string>& paths);

/// A received file.
class ImportFile {
 public:
  ImportFile(std::string path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}

  /// As the sender named it.
  const std::string& path() const { return path_; }
  uint64_t size() const;
  int descriptor() const { return descriptor_; }
  /// Maps it. Error: it is empty or cannot be mapped.
  Result<std::shared_ptr<const MappedFile>> map() const { return MappedFile::map(descriptor_, path_); }

 private:
  std::string path_;
  int descriptor_;  // open as long as the process lives
};

/// All received files: the file to be read first, then its companions.
class ImportFiles : public Companions {
 public:
  /// Receives until the sender closes its end.
  explicit ImportFiles(int socket);

  const std::vector<ImportFile>& all() const { return files_; }
  uint64_t bytes() const;  ///< sum over all files
  /// Returns the content of the first file. Error: it did not come, or is empty.
  Result<std::string_view> content();
  Result<std::string_view> content_of(const ImportFile& file);
  /// named: relative to the first file's folder.
  Result<std::string_view> read(const std::string& named) override;

 private:
  std::vector<ImportFile> files_;
  std::vector<std::shared_ptr<const MappedFile>> mapped_;
};

}  // namespace telesplat::data
