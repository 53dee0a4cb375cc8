#include "common/core/whole_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "common/core/descriptor.h"

namespace telesplat {
namespace {

constexpr size_t kPiece = 64 << 10;
constexpr int kTries = 100;  // names tried for a new file

Error failed(const std::string& path, const char* what) {
  return Error{fmt::format("{}: {}: {}", path, what, std::strerror(errno))};
}

Error too_large(const std::string& path, const std::string& bytes, uint64_t most_bytes) {
  return Error{fmt::format("{}: has {} bytes, limit {}", path, bytes, most_bytes)};
}

Status check(const std::string& path, const struct stat& about, uint64_t most_bytes) {
  if (S_ISDIR(about.st_mode)) return Error{path + ": is a folder"};
  if (!S_ISREG(about.st_mode)) return Error{path + ": is not a regular file"};
  if (uint64_t(about.st_size) > most_bytes) return too_large(path, std::to_string(about.st_size), most_bytes);
  return ok_status();
}

// Makes a new file beside `path`, under a name that no file has. Returns its descriptor; negative: errno says why.
int make_part(const std::string& path, std::string& part, unsigned mode = 0666) {
  static std::atomic<unsigned> made{0};
  for (int tries = 0; tries < kTries; ++tries) {
    part = fmt::format("{}.{}-{}.part", path, getpid(), ++made);
    const int fd = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode);
    if (fd >= 0 || errno != EEXIST) return fd;
  }
  return -1;
}

bool write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(fd, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n == 0) errno = ENOSPC;
    if (n <= 0) return false;
    text.remove_prefix(size_t(n));
  }
  return true;
}

}  // namespace

Result<std::string> read_whole(const std::string& path, uint64_t most_bytes) {
  // O_NONBLOCK: opening a pipe, given by mistake, does not wait.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  struct stat about {};
  if (file.get() < 0 || fstat(file.get(), &about) != 0) return failed(path, "cannot be read");
  if (const Status s = check(path, about, most_bytes); !s) return s.error();
  std::string out;
  out.reserve(size_t(about.st_size));
  for (std::array<char, kPiece> piece;;) {
    const ssize_t n = ::read(file.get(), piece.data(), piece.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return failed(path, "cannot be read");
    if (n == 0) return out;
    if (out.size() + size_t(n) > most_bytes)
      return too_large(path, fmt::format("more than {}", most_bytes), most_bytes);
    out.append(piece.data(), size_t(n));
  }
}

Status check_readable(const std::string& path, uint64_t most_bytes) {
  struct stat about {};
  if (stat(path.c_str(), &about) != 0 || access(path.c_str(), R_OK) != 0) return failed(path, "cannot be read");
  return check(path, about, most_bytes);
}

Result<std::string> new_part(const std::string& path) {
  std::string part;
  const Descriptor file(make_part(path, part));
  if (file.get() < 0) return failed(path, "cannot be written");
  return part;
}

Status write_whole(const std::string& path, std::string_view text, unsigned mode) {
  std::string part;
  Descriptor file(make_part(path, part, mode));
  if (file.get() < 0) return failed(path, "cannot be written");
  const bool written = write_all(file.get(), text) && file.close() && rename(part.c_str(), path.c_str()) == 0;
  if (written) return ok_status();
  const Error error = failed(path, "cannot be written");
  unlink(part.c_str());
  return error;
}

std::error_code make_private_folder(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return {};
  const std::filesystem::path folder = std::filesystem::absolute(path, error).lexically_normal();
  std::filesystem::path made;
  for (const auto& part : folder) {
    made /= part;
    if (mkdir(made.c_str(), 0700) == 0 || std::filesystem::is_directory(made, error)) continue;
    return {errno, std::generic_category()};
  }
  return {};
}

}  // namespace telesplat
