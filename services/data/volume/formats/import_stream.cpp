#include "services/data/volume/formats/import_stream.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace telesplat::data {
namespace {

enum class Kind : uint32_t { kProgress = 1, kError = 2, kVolume = 3 };

struct Message {
  Kind kind = Kind::kError;
  uint32_t unused = 0;
  uint64_t bytes = 0;  // bytes after the message's head
};

// Follows Kind::kVolume, before the voxels.
struct Placed {
  int64_t size[3];
  double columns[12], scale, offset;
  uint32_t stored, ct;
};

constexpr size_t kBlock = 256 << 10;
constexpr size_t kMostText = 4096;

bool read_all(int descriptor, void* to, size_t bytes) {
  char* p = static_cast<char*>(to);
  while (bytes > 0) {
    const ssize_t n = read(descriptor, p, bytes);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    p += n, bytes -= static_cast<size_t>(n);
  }
  return true;
}

// bytes: number of bytes that follow the head; data: the first of them.
bool send(int descriptor, Kind kind, uint64_t bytes, const void* data, uint64_t data_bytes) {
  const Message message{kind, 0, bytes};
  return write_all(descriptor, &message, sizeof message) && write_all(descriptor, data, data_bytes);
}

// Reading's share of the progress: with VTK, little time passes after its reader is done.
constexpr double kShareOfReading = 0.9;

std::optional<Result<StreamedVolume>> receive_voxels(int descriptor, uint64_t message_bytes, uint64_t most_bytes,
                                                     const std::string& path, const ReadProgress& progress) {
  Placed placed;
  if (message_bytes < sizeof placed || !read_all(descriptor, &placed, sizeof placed)) return std::nullopt;
  StreamedVolume out;
  VolumeFileHeader& h = out.header;
  for (size_t a = 0; a < 3; ++a) {
    h.size[a] = placed.size[a];
    if (h.size[a] < 1 || h.size[a] > (1 << 20)) return std::nullopt;
  }
  if (placed.stored > uint32_t(StoredType::kF64)) return std::nullopt;
  h.stored = static_cast<StoredType>(placed.stored);
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 3; ++r) h.index_to_data[c][r] = placed.columns[3 * c + r];
  h.scale = placed.scale, h.offset = placed.offset, h.ct = placed.ct != 0;
  const uint64_t bytes = h.voxel_bytes();
  if (bytes != message_bytes - sizeof placed) return std::nullopt;
  if (bytes > most_bytes)
    return Result<StreamedVolume>(
        Error{fmt::format("{}: has {} x {} x {} voxels of {}, more than the {} bytes that its header claims", path,
                          h.size[0], h.size[1], h.size[2], name_of(h.stored), most_bytes)});
  out.bytes.reserve(bytes);
  while (out.bytes.size() < bytes) {
    const size_t begin = out.bytes.size(), n = std::min<uint64_t>(kBlock, bytes - begin);
    out.bytes.resize(begin + n);
    if (!read_all(descriptor, out.bytes.data() + begin, n)) return std::nullopt;
    if (progress) progress(kShareOfReading + (1 - kShareOfReading) * double(begin + n) / double(bytes));
  }
  return Result<StreamedVolume>(std::move(out));
}

}  // namespace

bool write_all(int descriptor, const void* data, uint64_t bytes) {
  const char* p = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t n = write(descriptor, p, std::min<uint64_t>(bytes, 1 << 30));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    p += n, bytes -= static_cast<uint64_t>(n);
  }
  return true;
}

bool send_progress(int descriptor, double fraction) {
  return send(descriptor, Kind::kProgress, sizeof fraction, &fraction, sizeof fraction);
}

bool send_error(int descriptor, const std::string& text) {
  const size_t bytes = std::min(text.size(), kMostText);
  return send(descriptor, Kind::kError, bytes, text.data(), bytes);
}

bool send_volume(int descriptor, const VolumeFileHeader& h, const void* voxels) {
  Placed placed{};
  std::copy(h.size.begin(), h.size.end(), placed.size);
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 3; ++r) placed.columns[3 * c + r] = h.index_to_data[c][r];
  placed.scale = h.scale, placed.offset = h.offset;
  placed.stored = static_cast<uint32_t>(h.stored), placed.ct = h.ct;
  return send(descriptor, Kind::kVolume, sizeof placed + h.voxel_bytes(), &placed, sizeof placed) &&
         write_all(descriptor, voxels, h.voxel_bytes());
}

std::optional<Result<StreamedVolume>> receive_volume(int descriptor, uint64_t most_bytes, const std::string& path,
                                                     const ReadProgress& progress) {
  for (Message message; read_all(descriptor, &message, sizeof message);) {
    if (message.kind == Kind::kVolume) return receive_voxels(descriptor, message.bytes, most_bytes, path, progress);
    if (message.kind == Kind::kError) {
      std::string text(std::min<uint64_t>(message.bytes, kMostText), '\0');
      if (text.empty() || !read_all(descriptor, text.data(), text.size())) return std::nullopt;
      return Result<StreamedVolume>(Error{text});
    }
    double fraction = 0;
    if (message.kind != Kind::kProgress || message.bytes != sizeof fraction ||
        !read_all(descriptor, &fraction, sizeof fraction))
      return std::nullopt;
    if (progress && fraction >= 0 && fraction <= 1) progress(kShareOfReading * fraction);
  }
  return std::nullopt;
}

}  // namespace telesplat::data
