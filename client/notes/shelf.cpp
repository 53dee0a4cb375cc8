#include "client/notes/shelf.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>

#include "common/core/descriptor.h"
#include "common/core/whole_file.h"

namespace telesplat::notes {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSuffix = ".notes.json";

bool exists(const std::string& path) {
  std::error_code error;
  return !path.empty() && fs::exists(path, error);
}

// Returns nothing if there is no such file.
Result<std::optional<Book>> read_file(const std::string& path) {
  if (!exists(path)) return std::optional<Book>();
  const auto text = read_whole(path, kMaxBytes);
  if (!text) return text.error();
  auto book = book_from_json(*text);
  if (!book) return Error{path + ": " + book.error().text};
  return std::optional(*std::move(book));
}

constexpr std::chrono::seconds kLockPatience{5};  // another program holds a folder's lock while it writes a file

// Returns 0, else errno.
int write_all(int descriptor, const std::string& text) {
  for (size_t done = 0; done < text.size();) {
    const ssize_t n = write(descriptor, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return n < 0 ? errno : EIO;
    done += size_t(n);
  }
  return fsync(descriptor) != 0 ? errno : 0;
}

// Makes a new file in this folder. Its name is new there, and is valid in any file system.
int make_part(const fs::path& folder, mode_t mode, std::string& name) {
  static std::atomic<unsigned> made{0};
  for (int tries = 0; tries < 1000; ++tries) {
    name = (folder / fmt::format(".notes-{}-{}.part", getpid(), made++)).string();
    const int descriptor = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    if (descriptor >= 0 || errno != EEXIST) return descriptor;
  }
  return -1;
}

// Gives a new file the owner, group and mode of the file that it is to replace. Only root gives files away: if owner or
// group change, the mode must still let the old ones use the file. Returns 0, else errno.
int take_after(int descriptor, const struct stat& before) {
  struct stat now;
  if (fstat(descriptor, &now) != 0) return errno;
  const bool same = now.st_uid == before.st_uid && now.st_gid == before.st_gid;
  if (!same && fchown(descriptor, before.st_uid, before.st_gid) != 0) [[maybe_unused]]
    const int group_kept = fchown(descriptor, static_cast<uid_t>(-1), before.st_gid);
  if (fstat(descriptor, &now) != 0) return errno;
  const mode_t mode = before.st_mode & 0777, group = (mode >> 3) & 7, others = mode & 7;
  const bool same_group = now.st_gid == before.st_gid;
  if (!same_group && (group & ~others) != 0) return EPERM;
  if (now.st_uid != before.st_uid && ((same_group ? group : others) & 6) != 6) return EPERM;
  return (now.st_mode & 0777) != mode && fchmod(descriptor, mode) != 0 ? errno : 0;
}

// The old file stays until the new one is whole; those who could read and write it still can. Returns 0, else errno.
int replace_file(const std::string& path, const std::string& text) {
  struct stat before;
  const bool there = stat(path.c_str(), &before) == 0;
  std::string part;
  const int descriptor = make_part(fs::path(path).parent_path(), there ? 0600 : 0666, part);
  if (descriptor < 0) return errno;
  int failed = there ? take_after(descriptor, before) : 0;
  if (failed == 0) failed = write_all(descriptor, text);
  if (close(descriptor) != 0 && failed == 0) failed = errno;
  if (failed == 0 && rename(part.c_str(), path.c_str()) != 0) failed = errno;
  if (failed != 0) unlink(part.c_str());
  return failed;
}

// Follows links to the file that they lead to. Empty: a link leads nowhere.
std::string behind_links(const std::string& path) {
  std::error_code error;
  if (!fs::is_symlink(fs::symlink_status(path, error))) return path;
  const fs::path file = fs::canonical(path, error);
  return error ? std::string() : file.string();
}

bool can_write_beside(const std::string& path) {
  const std::string file = path.empty() ? path : behind_links(path);
  if (file.empty()) return false;
  const std::string folder = fs::path(file).parent_path().string();
  return access(folder.c_str(), W_OK | X_OK) == 0 && (!exists(file) || access(file.c_str(), W_OK) == 0);
}

// True if the book must go to another folder. A folder may be writable though this file is not: in a folder like /tmp
// another person's file cannot be replaced (EPERM).
bool is_elsewhere(int failed) {
  return failed == ENAMETOOLONG || failed == EROFS || failed == EACCES || failed == EPERM;
}

std::string read_path(const Shelf& shelf) {
  return exists(shelf.in_cache) || !exists(shelf.beside) ? shelf.in_cache : shelf.beside;
}

// Does change_book() with this one file. failed: errno if the file could not be written, else unchanged.
Status change_in(const std::string& to, const Shelf& shelf, const std::function<Status(Book&)>& change, int& failed) {
  const std::string file = behind_links(to);
  if (file.empty()) return Error{to + ": is a link that leads nowhere"};
  const fs::path folder = fs::path(file).parent_path();
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return Error{fmt::format("{}: {}", folder.string(), error.message())};
  const Descriptor lock{open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  if (!lock.lock_within(kLockPatience))
    return Error{fmt::format("{}: another program has locked this folder for {} s; nothing was kept", folder.string(),
                             kLockPatience.count())};
  auto book = read_book(shelf);
  if (!book) return book.error();
  if (const Status s = change(*book); !s) return s;
  const std::string text = to_json(*book);
  if (text.size() > kMaxBytes)
    return Error{fmt::format("{}: would have {} bytes, limit {}", to, text.size(), kMaxBytes)};
  failed = replace_file(file, text);
  if (failed != 0) return Error{fmt::format("{}: cannot be written: {}", to, std::strerror(failed))};
  fsync(lock.get());
  return ok_status();
}

}  // namespace

std::string user_cache_folder() {
  if (const char* folder = std::getenv("XDG_CACHE_HOME"); folder && *folder) return std::string(folder) + "/telesplat";
  if (const char* home = std::getenv("HOME"); home && *home) return std::string(home) + "/.cache/telesplat";
  return {};
}

Shelf shelf_of(const std::string& data_file, const std::string& scene, const std::string& cache_folder) {
  Shelf out;
  std::string named = data_file;
  while (named.size() > 1 && named.back() == '/') named.pop_back();  // a folder of DICOM files
  if (!named.empty()) out.beside = named + kSuffix;
  if (cache_folder.empty()) return out;
  const std::string of = named.empty() ? scene : named;
  const std::string name = named.empty() ? "scene" : fs::path(named).filename().string();
  out.in_cache = fmt::format("{}/notes/{}-{:016x}{}", cache_folder, name.substr(0, 80),
                             XXH3_64bits(of.data(), of.size()), kSuffix);
  return out;
}

Result<Book> read_book(const Shelf& shelf, std::string* path) {
  const std::string from = read_path(shelf);
  if (path) *path = from;
  auto book = read_file(from);
  if (!book) return book.error();
  return *book ? **book : Book();
}

Status change_book(const Shelf& shelf, const std::function<Status(Book&)>& change, std::string* path) {
  const bool beside = !exists(shelf.in_cache) && can_write_beside(shelf.beside);
  const std::string& to = beside ? shelf.beside : shelf.in_cache;
  if (to.empty()) return Error{"notes have nowhere to go: neither HOME nor XDG_CACHE_HOME is set"};
  int failed = 0;
  Status changed = change_in(to, shelf, change, failed);
  const std::string* written = &to;
  if (!changed && beside && is_elsewhere(failed) && !shelf.in_cache.empty()) {
    written = &shelf.in_cache;
    changed = change_in(*written, shelf, change, failed);
  }
  if (changed && path) *path = *written;
  return changed;
}

}  // namespace telesplat::notes
