// A file, memory-mapped read-only.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "common/core/result.h"
#include "services/data/base/cut_off.h"

namespace telesplat::data {

/// The bytes live as long as the object. Move-free: hold it by shared_ptr. Who reads bytes that somebody has cut off
/// meanwhile gets SIGBUS (cut_off.h).
class MappedFile {
 public:
  /// Maps a regular, readable file that is not empty. Errors name the path and say which of these it is not.
  static Result<std::shared_ptr<const MappedFile>> open(const std::string& path);
  /// Maps an open file of at least one byte; the descriptor stays the caller's.
  static Result<std::shared_ptr<const MappedFile>> map(int descriptor, const std::string& name);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::span<const std::byte> bytes() const { return {data_, size_}; }
  std::string_view text() const { return {reinterpret_cast<const char*>(data_), size_}; }

 private:
  MappedFile(const std::byte* data, size_t size, const std::string& name)
      : data_(data), size_(size), named_(data, size, name) {}
  const std::byte* data_;
  size_t size_;
  NamedMapping named_;
};

}  // namespace telesplat::data
