#include "services/data/base/mapped_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace telesplat::data {

Result<std::shared_ptr<const MappedFile>> MappedFile::map(int descriptor, const std::string& name) {
  struct stat status;
  if (fstat(descriptor, &status) != 0) return Error{fmt::format("{}: {}", name, std::strerror(errno))};
  if (S_ISDIR(status.st_mode)) return Error{fmt::format("{}: is a directory, not a mesh file", name)};
  if (!S_ISREG(status.st_mode)) return Error{fmt::format("{}: is not a regular file", name)};
  if (status.st_size <= 0) return Error{fmt::format("{}: is empty (0 bytes)", name)};
  const auto size = static_cast<size_t>(status.st_size);
  void* data = mmap(nullptr, size, PROT_READ, MAP_SHARED, descriptor, 0);
  if (data == MAP_FAILED)
    return Error{fmt::format("{}: {} bytes cannot be mapped: {}", name, size, std::strerror(errno))};
  return std::shared_ptr<const MappedFile>(new MappedFile(static_cast<const std::byte*>(data), size, name));
}

Result<std::shared_ptr<const MappedFile>> MappedFile::open(const std::string& path) {
  // O_NONBLOCK: a pipe given by mistake must not hang us.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return Error{fmt::format("{}: cannot be opened: {}", path, std::strerror(errno))};
  auto mapped = map(descriptor, path);
  close(descriptor);
  return mapped;
}

MappedFile::~MappedFile() { munmap(const_cast<std::byte*>(data_), size_); }

}  // namespace telesplat::data
