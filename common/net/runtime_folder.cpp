#include "common/net/runtime_folder.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace telesplat::net {
namespace {

constexpr size_t kMostNames = 1000;

Error failed(const std::string& path, const char* what) {
  return Error{fmt::format("{}: {}: {}", path, what, std::strerror(errno))};
}

bool write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(fd, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    text.remove_prefix(size_t(n));
  }
  return true;
}

}  // namespace

std::vector<std::string> RuntimeFolder::candidates() {
  const auto from = [](const char* variable) {
    const char* value = std::getenv(variable);
    return std::string(value ? value : "");
  };
  if (const std::string told = from("TELESPLAT_RUNTIME"); !told.empty()) return {told};
  std::vector<std::string> out;
  if (const std::string user = from("XDG_RUNTIME_DIR"); !user.empty()) out.push_back(user + "/telesplat");
  out.push_back(fmt::format("/tmp/telesplat-{}", geteuid()));
  return out;
}

Result<RuntimeFolder> RuntimeFolder::open(const std::string& path, bool make) {
  if (make && mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) return failed(path, "cannot be made");
  const int fd = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (fd < 0) return failed(path, "cannot be opened as a folder");
  RuntimeFolder out(path, fd);
  struct stat about {};
  if (fstat(fd, &about) != 0) return failed(path, "cannot be looked at");
  if (about.st_uid != geteuid())
    return Error{fmt::format("{}: belongs to user {}, not {}", path, about.st_uid, geteuid())};
  if (about.st_mode & (S_IWGRP | S_IWOTH))
    return Error{fmt::format("{}: others may write into it (mode {:o})", path, about.st_mode & 07777)};
  return out;
}

Result<RuntimeFolder> RuntimeFolder::make() {
  Error last;
  for (const auto& path : candidates()) {
    auto folder = open(path, true);
    if (folder) return folder;
    last = folder.error();
  }
  return last;
}

RuntimeFolder::~RuntimeFolder() {
  if (fd_ >= 0) close(fd_);
}

RuntimeFolder::RuntimeFolder(RuntimeFolder&& other) noexcept
    : path_(std::move(other.path_)), fd_(std::exchange(other.fd_, -1)) {}

Status RuntimeFolder::write(const std::string& name, const std::string& text) const {
  return put(name, text, Place::kReplaces);
}

Status RuntimeFolder::create(const std::string& name, const std::string& text) const {
  return put(name, text, Place::kIsNew);
}

Status RuntimeFolder::put(const std::string& name, const std::string& text, Place place) const {
  const std::string partial = fmt::format(".{}.{}", name, getpid());
  unlinkat(fd_, partial.c_str(), 0);  // left by a process of this number that died here
  const int fd = openat(fd_, partial.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
  if (fd < 0) return failed(path_ + "/" + name, "cannot be written");
  // A new file must not be lost: writes its bytes to the disk before it gets its name.
  const bool is_new = place == Place::kIsNew, written = write_all(fd, text) && (!is_new || fsync(fd) == 0);
  const bool whole = close(fd) == 0 && written;
  if (whole && !is_new && renameat(fd_, partial.c_str(), fd_, name.c_str()) == 0) return ok_status();
  const bool linked = whole && is_new && linkat(fd_, partial.c_str(), fd_, name.c_str(), 0) == 0;
  const Error error = failed(path_ + "/" + name, "cannot be written");
  unlinkat(fd_, partial.c_str(), 0);
  if (linked) return ok_status();
  return error;
}

void RuntimeFolder::remove(const std::string& name) const { unlinkat(fd_, name.c_str(), 0); }

std::vector<std::string> RuntimeFolder::names() const {
  std::vector<std::string> out;
  const int fd = openat(fd_, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);  // has its own read position
  DIR* folder = fd < 0 ? nullptr : fdopendir(fd);
  if (!folder) {
    if (fd >= 0) close(fd);
    return out;
  }
  while (const dirent* entry = readdir(folder)) {
    if (out.size() == kMostNames) break;
    if (entry->d_name[0] != '.') out.emplace_back(entry->d_name);
  }
  closedir(folder);
  return out;
}

std::optional<std::string> RuntimeFolder::read(const std::string& name, size_t most_bytes) const {
  // O_NONBLOCK: opening a pipe of that name does not wait.
  const int fd = openat(fd_, name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return std::nullopt;
  struct stat about {};
  std::string out;
  bool good = fstat(fd, &about) == 0 && S_ISREG(about.st_mode) && about.st_uid == geteuid() &&
              about.st_size <= off_t(most_bytes);
  for (char buffer[4096]; good;) {
    const ssize_t n = ::read(fd, buffer, sizeof buffer);
    if (n == 0) break;
    if (n < 0 && errno == EINTR) continue;
    good = n > 0 && out.size() + size_t(n) <= most_bytes;
    if (good) out.append(buffer, size_t(n));
  }
  close(fd);
  return good ? std::optional(std::move(out)) : std::nullopt;
}

}  // namespace telesplat::net
