// Memory-mapped, read-only files, and the files that a data file names: material libraries, pictures, buffers, pieces.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "common/core/result.h"
#include "common/image/file.h"
#include "services/data/base/cut_off.h"

namespace telesplat::data {

/// Bytes of a mapped file that are read before drop_pages().
inline constexpr size_t kMostResident = 64 << 20;

/// The bytes live as long as the object. Not movable: hold it by shared_ptr. Reading bytes that another process has cut
/// off meanwhile raises SIGBUS (cut_off.h).
class MappedFile {
 public:
  /// Maps a regular, readable file that is not empty. Errors name the path and the condition that fails.
  static Result<std::shared_ptr<const MappedFile>> open(const std::string& path);
  /// Maps an open file of at least one byte; the caller keeps and closes the descriptor.
  static Result<std::shared_ptr<const MappedFile>> map(int descriptor, const std::string& name);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::span<const std::byte> bytes() const { return {data_, size_}; }
  std::string_view text() const { return {reinterpret_cast<const char*>(data_), size_}; }
  /// Takes the pages of a part of bytes() out of this process's resident memory. They stay in the page cache, and come
  /// back when they are read. Any thread.
  void drop_pages(std::span<const std::byte> part) const;
  void drop_pages() const { drop_pages(bytes()); }

 private:
  MappedFile(const std::byte* data, size_t size, const std::string& name)
      : data_(data), size_(size), named_(data, size, name) {}
  const std::byte* data_;
  size_t size_;
  NamedMapping named_;
};

/// Gives readers the other files that their file names, from any source.
class Companions {
 public:
  virtual ~Companions() = default;
  /// Returns the content of a file named in the data file, relative to that file's folder. It stays valid as long as
  /// this object. Error, naming the file: it does not exist, or may not be read.
  virtual Result<std::string_view> read(const std::string& named) = 0;
  /// Decodes the picture in `bytes`, as image::read_picture(). Error: only telesplat-import decodes pictures.
  virtual Result<image::View> picture(std::string_view bytes, const std::string& name, uint64_t most_pixels);
};

/// Files on disk.
class FolderCompanions : public Companions {
 public:
  /// path: the data file's.
  explicit FolderCompanions(const std::string& path) : folder_(std::filesystem::path(path).parent_path()) {}
  Result<std::string_view> read(const std::string& named) override;

 private:
  std::filesystem::path folder_;
  std::map<std::string, std::shared_ptr<const MappedFile>> files_;
};

}  // namespace telesplat::data
