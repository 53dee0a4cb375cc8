#include "client/viewer/record/record_file.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "common/core/check.h"
#include "common/core/log.h"
#include "common/core/whole_file.h"
#include "common/wire/limits.h"

namespace telesplat::viewer {
namespace {

constexpr size_t kMagicBytes = 8;
constexpr uint32_t kMaxType = 32;
constexpr uint64_t kMaxBody = wire::kMaxBulkBytes + wire::kMaxControlBytes;  // a sparse file may claim more

}  // namespace

Result<RecordWriter> RecordWriter::open(const std::string& path, std::string_view magic, uint64_t max_bytes,
                                        const char* what) {
  CHECK(magic.size() == kMagicBytes);
  RecordWriter out;
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, kPrivate);
  if (fd >= 0) out.file_.reset(fdopen(fd, "wb"));
  if (!out.file_ || std::fwrite(magic.data(), 1, magic.size(), out.file_.get()) != magic.size())
    return Error{fmt::format("{}: cannot be written: {}", path, std::strerror(errno))};
  out.path_ = path;
  out.what_ = what;
  out.max_bytes_ = max_bytes;
  return out;
}

void RecordWriter::write(std::string_view type, std::string_view body) {
  const uint64_t more = 12 + type.size() + body.size();
  if (full_) return;
  if (bytes_ + more > max_bytes_) {
    full_ = true;
    log::warn("{}: {} MiB of {} are recorded, the rest is left out", path_, max_bytes_ >> 20, what_);
    return;
  }
  const auto type_bytes = static_cast<uint32_t>(type.size());
  const auto body_bytes = static_cast<uint64_t>(body.size());
  FILE* f = file_.get();
  const bool ok = std::fwrite(&type_bytes, 4, 1, f) == 1 && std::fwrite(&body_bytes, 8, 1, f) == 1 &&
                  std::fwrite(type.data(), 1, type.size(), f) == type.size() &&
                  std::fwrite(body.data(), 1, body.size(), f) == body.size();
  bytes_ += more;
  if (!ok) fail(errno);
}

void RecordWriter::flush() {
  if (!failed() && std::fflush(file_.get()) != 0) fail(errno);
}

void RecordWriter::fail(int error) {
  full_ = true;
  error_ = error;
  log::error("{}: cannot be written: {}; the session goes on without the rest of it", path_, std::strerror(error));
}

Result<RecordReader> RecordReader::open(const std::string& path, const std::vector<std::string_view>& magics,
                                        const char* what) {
  RecordReader out;
  out.path_ = path;
  std::error_code error;
  if (std::filesystem::is_regular_file(path, error)) out.file_.reset(std::fopen(path.c_str(), "rb"));
  char magic[kMagicBytes];
  const bool read = out.file_ && std::fread(magic, 1, sizeof magic, out.file_.get()) == sizeof magic;
  if (!read || std::find(magics.begin(), magics.end(), std::string_view(magic, sizeof magic)) == magics.end())
    return Error{fmt::format("{}: is not {}", path, what)};
  out.left_ = std::filesystem::file_size(path, error) - sizeof magic;
  if (error) return Error{fmt::format("{}: {}", path, error.message())};
  return out;
}

bool RecordReader::next() {
  uint32_t type_bytes = 0;
  uint64_t body_bytes = 0;
  FILE* f = file_.get();
  if (std::fread(&type_bytes, 4, 1, f) != 1 || std::fread(&body_bytes, 8, 1, f) != 1) return false;
  left_ -= std::min<uint64_t>(left_, 12);
  if (type_bytes > kMaxType || body_bytes > kMaxBody || type_bytes + body_bytes > left_) return false;
  type_.resize(type_bytes);
  body_.resize(body_bytes);
  left_ -= type_bytes + body_bytes;
  return std::fread(type_.data(), 1, type_.size(), f) == type_.size() &&
         std::fread(body_.data(), 1, body_.size(), f) == body_.size();
}

Error RecordReader::wrong(const std::string& what) const {
  return Error{fmt::format("{}: {}: {}", path_, type_, what)};
}

}  // namespace telesplat::viewer
