#include "services/master/record/text_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "common/core/log.h"
#include "common/core/utf8.h"
#include "common/core/whole_file.h"

namespace telesplat::metrics {
namespace {

constexpr size_t kBuffer = 64 << 10;

// Writes all of `text`. Returns 0, or errno.
int write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(fd, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno;
    if (n == 0) return ENOSPC;
    text.remove_prefix(size_t(n));
  }
  return 0;
}

}  // namespace

TextFile& TextFile::operator=(TextFile&& other) noexcept {
  if (this == &other) return *this;
  close();
  fd_ = std::exchange(other.fd_, -1);
  path_ = std::move(other.path_);
  buffer_ = std::exchange(other.buffer_, {});
  limit_bytes_ = other.limit_bytes_;
  bytes_ = other.bytes_;
  buffered_rows_ = std::exchange(other.buffered_rows_, 0);
  rows_lost_ = other.rows_lost_;
  rows_cut_ = other.rows_cut_;
  status_ = other.status_;
  return *this;
}

bool TextFile::open(const std::string& path, uint64_t limit_bytes) { return open_behind(path, 0, limit_bytes); }

bool TextFile::open_behind(const std::string& path, uint64_t keep_bytes, uint64_t limit_bytes) {
  *this = TextFile();
  path_ = path;
  limit_bytes_ = limit_bytes;
  bytes_ = keep_bytes;
  // The path may be a device or a pipe, which cannot be cut off.
  fd_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | (keep_bytes ? 0 : O_TRUNC), kPrivate);
  if (fd_ < 0 || keep_bytes == 0) return is_open();
  if (ftruncate(fd_, off_t(keep_bytes)) == 0 && lseek(fd_, 0, SEEK_END) == off_t(keep_bytes)) return true;
  const int error = errno;
  ::close(std::exchange(fd_, -1));
  errno = error;
  return false;
}

void TextFile::write(std::string_view row) {
  if (fd_ < 0) return;
  if (rows_cut_ > 0 || (limit_bytes_ > 0 && bytes_ + buffer_.size() + row.size() > limit_bytes_)) {
    if (rows_cut_++ == 0) log::warn("{}: has its {} MB; further rows are left out", path_, limit_bytes_ / 1'000'000);
    return;
  }
  put(row);
}

void TextFile::write_end(std::string_view row) {
  if (fd_ >= 0) put(row);
}

void TextFile::put(std::string_view row) {
  if (!valid_utf8(row)) return put(to_utf8(row));
  if (!status_) {
    ++rows_lost_;
    return;
  }
  buffer_ += row;
  ++buffered_rows_;
  if (buffer_.size() >= kBuffer) flush();
}

void TextFile::flush() {
  if (fd_ < 0 || buffer_.empty()) return;
  if (const int error = write_all(fd_, buffer_))
    fail(error);
  else
    bytes_ += buffer_.size();
  buffer_.clear();
  buffered_rows_ = 0;
}

void TextFile::fail(int error) {
  rows_lost_ += buffered_rows_;
  status_ = Error{fmt::format("{}: cannot be written: {}", path_, std::strerror(error))};
  log::error("{}; the run goes on without the rest of it", status_.error().text);
  if (ftruncate(fd_, off_t(bytes_)) != 0) return;  // it ends in mid-row, which readers pass over
  lseek(fd_, 0, SEEK_END);
}

void TextFile::close() {
  flush();
  if (fd_ < 0) return;
  if (::close(std::exchange(fd_, -1)) == 0 || !status_) return;
  status_ = Error{fmt::format("{}: cannot be written: {}", path_, std::strerror(errno))};
  log::error("{}", status_.error().text);
}

std::string csv_line(const std::vector<std::string>& cells) {
  std::string out;
  for (const std::string& cell : cells) (out += cell) += ',';
  if (!out.empty()) out.pop_back();
  return out + '\n';
}

std::string csv_quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c == '\n' || c == '\r' ? ' ' : c;
  }
  return out + '"';
}

std::vector<std::string> csv_cells(std::string_view line) {
  std::vector<std::string> out(1);
  bool quoted = false;
  for (size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"')
      out.back() += line[++i];
    else if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      out.emplace_back();
    else
      out.back() += c;
  }
  return out;
}

std::string csv_cell(const std::string& text) {
  return text.find_first_of(",\"\r\n") == text.npos ? text : csv_quoted(text);
}

}  // namespace telesplat::metrics
