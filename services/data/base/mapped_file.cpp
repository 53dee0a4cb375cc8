#include "services/data/base/mapped_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "services/data/base/mesh.h"

namespace telesplat::data {

Result<std::shared_ptr<const MappedFile>> MappedFile::map(int descriptor, const std::string& name) {
  struct stat status;
  if (fstat(descriptor, &status) != 0) return Error{fmt::format("{}: {}", name, std::strerror(errno))};
  if (S_ISDIR(status.st_mode)) return Error{fmt::format("{}: is a directory, not a file", name)};
  if (!S_ISREG(status.st_mode)) return Error{fmt::format("{}: is not a regular file", name)};
  if (status.st_size <= 0) return Error{fmt::format("{}: is empty (0 bytes)", name)};
  const auto size = static_cast<size_t>(status.st_size);
  void* data = mmap(nullptr, size, PROT_READ, MAP_SHARED, descriptor, 0);
  if (data == MAP_FAILED)
    return Error{fmt::format("{}: {} bytes cannot be mapped: {}", name, size, std::strerror(errno))};
  return std::shared_ptr<const MappedFile>(new MappedFile(static_cast<const std::byte*>(data), size, name));
}

Result<std::shared_ptr<const MappedFile>> MappedFile::open(const std::string& path) {
  // O_NONBLOCK: opening a pipe given by mistake must not block.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return Error{fmt::format("{}: cannot be opened: {}", path, std::strerror(errno))};
  auto mapped = map(descriptor, path);
  close(descriptor);
  return mapped;
}

MappedFile::~MappedFile() { munmap(const_cast<std::byte*>(data_), size_); }

void MappedFile::drop_pages(std::span<const std::byte> part) const {
  constexpr size_t kPage = 4096;
  const size_t begin = static_cast<size_t>(part.data() - data_) / kPage * kPage;
  const auto end = static_cast<size_t>(part.data() + part.size() - data_);
  madvise(const_cast<std::byte*>(data_) + begin, end - begin, MADV_DONTNEED);
}

Result<image::View> Companions::picture(std::string_view, const std::string& name, uint64_t) {
  return Error{fmt::format("picture {} can be decoded by telesplat-import alone", name)};
}

Result<std::string_view> FolderCompanions::read(const std::string& named) {
  auto& file = files_[named];
  if (!file) {
    auto opened = MappedFile::open((folder_ / named).string());
    if (!opened) return opened.error();
    file = std::move(*opened);
  }
  return file->text();
}

uint64_t hash_files(const std::vector<std::string>& paths, const Progress& progress) {
  XXH3_state_t* state = XXH3_createState();
  XXH3_64bits_reset(state);
  for (size_t n = 0; n < paths.size(); ++n) {
    const auto file = MappedFile::open(paths[n]);
    if (!file) continue;
    const auto bytes = (*file)->bytes();
    for (size_t at = 0; at < bytes.size(); at += kMostResident) {
      const double of_file = static_cast<double>(at) / static_cast<double>(bytes.size());
      progress(kIdentifying, (static_cast<double>(n) + of_file) / static_cast<double>(paths.size()));
      const auto step = bytes.subspan(at, std::min(kMostResident, bytes.size() - at));
      XXH3_64bits_update(state, step.data(), step.size());
      (*file)->drop_pages(step);
    }
  }
  const uint64_t hash = XXH3_64bits_digest(state);
  XXH3_freeState(state);
  progress(kIdentifying, 1.0);
  return hash;
}

}  // namespace telesplat::data
