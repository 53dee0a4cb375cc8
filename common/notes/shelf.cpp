#include "common/notes/shelf.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>

namespace telesplat::notes {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSuffix = ".notes.json";

bool exists(const std::string& path) {
  std::error_code error;
  return !path.empty() && fs::exists(path, error);
}

// Nothing: there is no such file.
Result<std::optional<Book>> read_file(const std::string& path) {
  if (!exists(path)) return std::optional<Book>();
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return Error{path + ": is no file"};
  const uintmax_t bytes = fs::file_size(path, error);
  if (error) return Error{fmt::format("{}: {}", path, error.message())};
  if (bytes > kMaxBytes) return Error{fmt::format("{}: {} bytes, limit {}", path, bytes, kMaxBytes)};
  std::ifstream in(path, std::ios::binary);
  if (!in) return Error{fmt::format("{}: {}", path, std::strerror(errno))};
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  auto book = book_from_json(text);
  if (!book) return Error{path + ": " + book.error().text};
  return std::optional(*std::move(book));
}

// Whoever holds a folder is the only one who changes books in it.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& folder) : descriptor_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    if (descriptor_ >= 0) flock(descriptor_, LOCK_EX);  // where there are no locks two writers at once have bad luck
  }
  ~FolderLock() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  void sync() const {
    if (descriptor_ >= 0) fsync(descriptor_);
  }

 private:
  int descriptor_;
};

Status write_all(int descriptor, const std::string& text) {
  for (size_t done = 0; done < text.size();) {
    const ssize_t n = write(descriptor, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return Error{std::strerror(errno)};
    done += size_t(n);
  }
  if (fsync(descriptor) != 0) return Error{std::strerror(errno)};
  return ok_status();
}

// The old file stays until the new one is whole.
Status replace_file(const std::string& path, const std::string& text) {
  std::string part = path + ".XXXXXX";
  const int descriptor = mkostemp(part.data(), O_CLOEXEC);
  if (descriptor < 0) return Error{fmt::format("{}: {}", path, std::strerror(errno))};
  fchmod(descriptor, 0644);
  Status written = write_all(descriptor, text);
  if (close(descriptor) != 0 && written) written = Error{std::strerror(errno)};
  if (written && rename(part.c_str(), path.c_str()) != 0) written = Error{std::strerror(errno)};
  if (written) return ok_status();
  unlink(part.c_str());
  return Error{fmt::format("{}: cannot be written: {}", path, written.error().text)};
}

bool can_write_beside(const std::string& path) {
  if (path.empty()) return false;
  const std::string folder = fs::path(path).parent_path().string();
  return access(folder.c_str(), W_OK | X_OK) == 0 && (!exists(path) || access(path.c_str(), W_OK) == 0);
}

std::string read_path(const Shelf& shelf) {
  return exists(shelf.in_cache) || !exists(shelf.beside) ? shelf.in_cache : shelf.beside;
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
  const fs::path folder = fs::path(to).parent_path();
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return Error{fmt::format("{}: {}", folder.string(), error.message())};
  const FolderLock lock(folder);
  auto book = read_book(shelf);
  if (!book) return book.error();
  if (const Status s = change(*book); !s) return s;
  const std::string text = to_json(*book);
  if (text.size() > kMaxBytes)
    return Error{fmt::format("{}: would have {} bytes, limit {}", to, text.size(), kMaxBytes)};
  if (const Status s = replace_file(to, text); !s) return s;
  lock.sync();
  if (path) *path = to;
  return ok_status();
}

}  // namespace telesplat::notes
