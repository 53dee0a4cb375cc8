#include "services/data/volume/formats/payload.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <memory>

#include "services/data/volume/formats/header_text.h"

namespace telesplat::data {
namespace {

constexpr size_t kBlock = 256 << 10;  // stays in the second cache between being cleared and being filled

// A file read from front to back.
class Source {
 public:
  static Result<std::unique_ptr<Source>> open(const std::string& path, uint32_t lines, uint64_t at, bool at_end,
                                              uint64_t bytes) {
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor < 0) return Error{fmt::format("{}: cannot be opened: {}", path, std::strerror(errno))};
    auto source = std::unique_ptr<Source>(new Source(descriptor, path));
    struct stat status {};
    if (fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode))
      return Error{fmt::format("{}: is not a regular file", path)};
    const auto size = static_cast<uint64_t>(status.st_size);
    if (at_end && bytes > size) return Error{fmt::format("{}: has {} bytes of {}", path, size, bytes)};
    source->at_ = at_end ? size - bytes : at;
    if (const Status s = source->skip_lines(lines); !s) return s.error();
    posix_fadvise(descriptor, static_cast<off_t>(source->at_), 0, POSIX_FADV_SEQUENTIAL);
    return source;
  }
  ~Source() { close(descriptor_); }
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  /// As many bytes as there are, at most `bytes`; 0 at the end.
  Result<size_t> read(void* to, size_t bytes) {
    for (;;) {
      const ssize_t n = pread(descriptor_, to, bytes, static_cast<off_t>(at_));
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) return Error{fmt::format("{}: cannot be read: {}", path_, std::strerror(errno))};
      at_ += static_cast<uint64_t>(n);
      return static_cast<size_t>(n);
    }
  }

 private:
  // From at_ on, which moves behind them.
  Status skip_lines(uint32_t lines) {
    const uint64_t behind = at_;
    at_ = 0;
    std::string block(lines > 0 ? 4096 : 0, '\0');
    for (uint64_t begin = 0; lines > 0; begin = at_) {
      const auto n = read(block.data(), block.size());
      if (!n) return n.error();
      if (*n == 0) return Error{fmt::format("{}: ends within the lines to be left out", path_)};
      size_t i = 0;
      while (i < *n && lines > 0) lines -= block[i++] == '\n';
      if (lines == 0) at_ = begin + i;
    }
    at_ += behind;
    return ok_status();
  }

  Source(int descriptor, std::string path) : descriptor_(descriptor), path_(std::move(path)) {}
  int descriptor_;
  std::string path_;
  uint64_t at_ = 0;
};

Error too_short(const VolumeFileHeader& h, const std::string& path, uint64_t got) {
  return Error{fmt::format("{}: ends too early: {} bytes of voxels, of {} ({} x {} x {} of {})", path, got,
                           h.voxel_bytes(), h.size[0], h.size[1], h.size[2], name_of(h.stored))};
}

// Fills `out` by another file's share, block by block; `next(to, n)` gives up to n bytes, 0 at the end.
template <class Next>
Status fill(const VolumeFileHeader& h, const std::string& path, const ReadProgress& progress,
            std::vector<std::byte>& out, Next&& next) {
  const uint64_t bytes = h.voxel_bytes(), until = out.size() + bytes / h.parts();
  for (uint64_t steps = 0; out.size() < until; ++steps) {
    const size_t begin = out.size(), want = std::min<uint64_t>(kBlock, until - begin);
    out.resize(begin + want);
    size_t have = 0;
    while (have < want) {
      const Result<size_t> n = next(out.data() + begin + have, want - have);
      if (!n) return n.error();
      if (*n == 0) return too_short(h, path, begin + have);
      have += *n;
    }
    if (progress && steps % 16 == 0) progress(double(out.size()) / double(bytes));
  }
  return ok_status();
}

class Inflater {
 public:
  Inflater(Source& source, std::string path) : source_(source), path_(std::move(path)), packed_(kBlock) {
    ready_ = inflateInit2(&stream_, 15 + 32) == Z_OK;  // gzip or zlib, as it says
  }
  ~Inflater() {
    if (ready_) inflateEnd(&stream_);
  }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  Result<size_t> read(void* to, size_t bytes) {
    if (!ready_) return Error{path_ + ": no memory for unpacking it"};
    stream_.next_out = static_cast<Bytef*>(to);
    stream_.avail_out = static_cast<uInt>(bytes);
    while (stream_.avail_out == bytes && !ended_) {
      if (stream_.avail_in == 0) {
        const auto n = source_.read(packed_.data(), packed_.size());
        if (!n) return n.error();
        if (*n == 0) break;
        stream_.next_in = packed_.data();
        stream_.avail_in = static_cast<uInt>(*n);
      }
      const int status = inflate(&stream_, Z_NO_FLUSH);
      if (status == Z_STREAM_END) {
        // Another member may follow: gzip files may be joined.
        ended_ = stream_.avail_in < 2 || stream_.next_in[0] != 0x1f || inflateReset(&stream_) != Z_OK;
      } else if (status != Z_OK && status != Z_BUF_ERROR) {
        return Error{
            fmt::format("{}: its compressed data are damaged: {}", path_, stream_.msg ? stream_.msg : "zlib gave up")};
      }
    }
    return bytes - stream_.avail_out;
  }

 private:
  Source& source_;
  std::string path_;
  std::vector<Bytef> packed_;
  z_stream stream_{};
  bool ready_ = false, ended_ = false;
};

template <class T>
bool parse_value(std::string_view word, std::byte* to) {
  T value{};
  if (word.starts_with('+')) word.remove_prefix(1);
  const auto parsed = std::from_chars(word.data(), word.data() + word.size(), value);
  if (parsed.ec != std::errc() || parsed.ptr != word.data() + word.size()) return false;
  std::memcpy(to, &value, sizeof value);
  return true;
}

bool parse_stored(StoredType type, std::string_view word, std::byte* to) {
  switch (type) {
    case StoredType::kU8:
      return parse_value<uint8_t>(word, to);
    case StoredType::kI8:
      return parse_value<int8_t>(word, to);
    case StoredType::kU16:
      return parse_value<uint16_t>(word, to);
    case StoredType::kI16:
      return parse_value<int16_t>(word, to);
    case StoredType::kU32:
      return parse_value<uint32_t>(word, to);
    case StoredType::kI32:
      return parse_value<int32_t>(word, to);
    case StoredType::kU64:
      return parse_value<uint64_t>(word, to);
    case StoredType::kI64:
      return parse_value<int64_t>(word, to);
    case StoredType::kF32:
      return parse_value<float>(word, to);
    case StoredType::kF64:
      return parse_value<double>(word, to);
  }
  return false;
}

Status read_text(const VolumeFileHeader& h, Source& source, const std::string& path, const ReadProgress& progress,
                 std::vector<std::byte>& out) {
  std::string window;  // what is read and not parsed yet
  size_t at = 0;
  bool ended = false;
  const size_t size = stored_bytes(h.stored);
  return fill(h, path, progress, out, [&](std::byte* to, size_t bytes) -> Result<size_t> {
    size_t have = 0;
    while (have + size <= bytes) {
      const auto blank = [](char c) { return static_cast<unsigned char>(c) <= ' ' || c == ','; };
      while (at < window.size() && blank(window[at])) ++at;
      size_t end = at;
      while (end < window.size() && !blank(window[end])) ++end;
      if (end == window.size() && !ended) {  // a word may go on in what follows
        window.erase(0, at), at = 0;
        if (window.size() > 1000) return Error{fmt::format("{}: {} is no number", path, in_quotes(window))};
        const size_t old = window.size();
        window.resize(old + kBlock);
        const auto n = source.read(window.data() + old, kBlock);
        if (!n) return n.error();
        window.resize(old + *n);
        ended = *n == 0;
        continue;
      }
      if (end == at) break;
      const std::string_view word = std::string_view(window).substr(at, end - at);
      if (!parse_stored(h.stored, word, to + have))
        return Error{fmt::format("{}: {} is no number of type {}", path, in_quotes(word), name_of(h.stored))};
      at = end, have += size;
    }
    return have;
  });
}

Status read_part(const VolumeFileHeader& h, const std::string& file, const std::string& path,
                 const ReadProgress& progress, std::vector<std::byte>& out) {
  auto source = Source::open(file, h.line_skip, h.data_at, h.data_at_end, h.voxel_bytes() / h.parts());
  if (!source) return source.error();
  if (h.encoding == Encoding::kText) return read_text(h, **source, path, progress, out);
  if (h.encoding == Encoding::kRaw)
    return fill(h, path, progress, out, [&](std::byte* to, size_t bytes) { return (*source)->read(to, bytes); });
  Inflater inflater(**source, path);
  std::vector<std::byte> left_out(std::min<uint64_t>(h.skip_unpacked, kBlock));
  for (uint64_t left = h.skip_unpacked; left > 0;) {
    const auto n = inflater.read(left_out.data(), std::min<uint64_t>(left, left_out.size()));
    if (!n) return n.error();
    if (*n == 0) return too_short(h, path, 0);
    left -= *n;
  }
  const Status filled =
      fill(h, path, progress, out, [&](std::byte* to, size_t bytes) { return inflater.read(to, bytes); });
  // Reading on brings the stream's checksum, if the voxels were all of it.
  std::byte more;
  if (const auto n = inflater.read(&more, 1); filled && !n) return n.error();
  return filled;
}

}  // namespace

Status check_memory(uint64_t bytes, const std::string& path) {
  std::ifstream in("/proc/meminfo");
  std::string key, unit;
  for (uint64_t kb = 0; in >> key >> kb; std::getline(in, unit))
    if (key == "MemAvailable:" && bytes > kb * 1024)
      return Error{fmt::format("{}: takes {} MB of memory; this machine has {} MB free", path, bytes >> 20, kb >> 10)};
  return ok_status();
}

Result<std::vector<std::byte>> read_payload(const VolumeFileHeader& h, const std::string& path,
                                            const ReadProgress& progress) {
  std::vector<std::byte> out;
  out.reserve(h.voxel_bytes());  // address space; pages come with what is read
  for (size_t i = 0; i < h.parts(); ++i)
    if (const Status s = read_part(h, i == 0 ? h.data_path : h.more_paths[i - 1], path, progress, out); !s)
      return s.error();
  return out;
}

}  // namespace telesplat::data
