#include "services/data/volume/formats/header.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <type_traits>

#include "services/data/base/mapped_file.h"
#include "services/data/base/refusal.h"
#include "services/data/volume/formats/header_text.h"
#include "services/data/volume/formats/inflater.h"

namespace telesplat::data {
namespace {

constexpr size_t kCachedBytes = 256 << 10;  // stays in the second-level cache between clearing and filling

// Returns the part of a file that holds voxels, packed or not.
std::string_view behind_skips(std::string_view content, const VolumeFileHeader& h, const std::string& file) {
  const uint64_t bytes = h.voxel_bytes() / h.parts();
  if (h.data_at_end && bytes > content.size()) refuse("{}: has {} bytes of {}", file, content.size(), bytes);
  const uint64_t at = h.data_at_end ? content.size() - bytes : h.data_at;
  size_t lines = 0;  // bytes of the skipped lines
  for (uint32_t line = 0; line < h.line_skip; ++line) {
    lines = content.find('\n', lines) + 1;
    if (lines == 0) refuse("{}: ends within the lines to be left out", file);
  }
  return content.substr(std::min<uint64_t>(at + lines, content.size()));
}

[[noreturn]] void refuse_short(const VolumeFileHeader& h, const std::string& path, uint64_t got) {
  refuse("{}: ends too early: {} bytes of voxels, of {} ({} x {} x {} of {})", path, got, h.voxel_bytes(), h.size[0],
         h.size[1], h.size[2], name_of(h.stored));
}

// Appends a file's share to `out`, block by block; `next(to, n)` returns up to n bytes, 0 at the end.
template <class Next>
void fill(const VolumeFileHeader& h, const std::string& path, const ReadProgress& progress, std::vector<std::byte>& out,
          Next&& next) {
  const uint64_t bytes = h.voxel_bytes(), until = out.size() + bytes / h.parts();
  for (uint64_t steps = 0; out.size() < until; ++steps) {
    const size_t begin = out.size(), want = std::min<uint64_t>(kCachedBytes, until - begin);
    out.resize(begin + want);
    size_t have = 0;
    while (have < want) {
      const size_t n = next(out.data() + begin + have, want - have);
      if (n == 0) refuse_short(h, path, begin + have);
      have += n;
    }
    if (progress && steps % 16 == 0) progress(double(out.size()) / double(bytes));
  }
}

bool parse_stored(StoredType type, std::string_view word, std::byte* to) {
  if (word.starts_with('+')) word.remove_prefix(1);
  return with_type(type, [&](auto value) {
    const auto parsed = std::from_chars(word.data(), word.data() + word.size(), value);
    std::memcpy(to, &value, sizeof value);
    return parsed.ec == std::errc() && parsed.ptr == word.data() + word.size();
  });
}

// Parses as many values as fit.
size_t read_text(std::string_view& text, StoredType type, const std::string& path, std::byte* to, size_t bytes) {
  const auto blank = [](char c) { return static_cast<unsigned char>(c) <= ' ' || c == ','; };
  const size_t size = stored_bytes(type);
  size_t have = 0;
  for (; have + size <= bytes; have += size) {
    text.remove_prefix(size_t(std::find_if_not(text.begin(), text.end(), blank) - text.begin()));
    const std::string_view word = text.substr(0, size_t(std::find_if(text.begin(), text.end(), blank) - text.begin()));
    if (word.empty()) break;
    if (!parse_stored(type, word, to + have))
      refuse("{}: {} is no number of type {}", path, in_quotes(word), name_of(type));
    text.remove_prefix(word.size());
  }
  return have;
}

void read_part(const VolumeFileHeader& h, const std::string& name, const std::string& path,
               const ReadProgress& progress, std::vector<std::byte>& out) {
  const auto file = need(MappedFile::open(name));
  std::string_view rest = behind_skips(file->text(), h, name);
  if (h.encoding == Encoding::kText)
    return fill(h, path, progress, out,
                [&](std::byte* to, size_t bytes) { return read_text(rest, h.stored, path, to, bytes); });
  if (h.encoding == Encoding::kRaw)
    return fill(h, path, progress, out, [&](std::byte* to, size_t bytes) {
      const size_t n = rest.copy(reinterpret_cast<char*>(to), bytes);
      rest.remove_prefix(n);
      return n;
    });
  Inflater inflater(rest, path);
  std::vector<std::byte> left_out(std::min<uint64_t>(h.skip_unpacked, kCachedBytes));
  for (uint64_t left = h.skip_unpacked; left > 0;) {
    const size_t n = inflater.read(left_out.data(), std::min<uint64_t>(left, left_out.size()));
    if (n == 0) refuse_short(h, path, 0);
    left -= n;
  }
  fill(h, path, progress, out, [&](std::byte* to, size_t bytes) { return inflater.read(to, bytes); });
  // Reading on checks the stream's checksum, if the voxels end it.
  std::byte more;
  inflater.read(&more, 1);
}

struct Range {
  double lo = std::numeric_limits<double>::infinity(), hi = -std::numeric_limits<double>::infinity();
  uint64_t not_finite = 0;
};

template <class T>
Range range_of(const std::byte* bytes, size_t count) {
  const T* v = reinterpret_cast<const T*>(bytes);  // a vector's storage is aligned for any type
  T lo = std::numeric_limits<T>::max(), hi = std::numeric_limits<T>::lowest();
  uint64_t not_finite = 0;
  if constexpr (std::is_integral_v<T>) {
    for (size_t i = 0; i < count; ++i) lo = std::min(lo, v[i]), hi = std::max(hi, v[i]);
  } else {
    for (size_t i = 0; i < count; ++i) {
      const bool finite = v[i] - v[i] == 0;  // neither NaN nor infinite
      not_finite += !finite;
      lo = finite && v[i] < lo ? v[i] : lo;
      hi = finite && v[i] > hi ? v[i] : hi;
    }
  }
  return not_finite == count ? Range{0, 0, not_finite} : Range{double(lo), double(hi), not_finite};
}

// Works in place: writing never overtakes reading. Values become fractions of half their range around its middle, with
// scale and offset, if f32 has fewer than 4096 steps in that range, or cannot reach it.
template <class T>
void narrow(std::vector<std::byte>& bytes, const std::string& path, Volume& v) {
  const size_t count = bytes.size() / sizeof(T);
  const Range range = range_of<T>(bytes.data(), count);
  const double largest = std::max(std::abs(range.lo), std::abs(range.hi));
  const double steps = (range.hi - range.lo) / (largest * 0x1p-24);
  const bool fraction = largest > double(std::numeric_limits<float>::max()) || (range.hi > range.lo && steps < 4096);
  const double half = (range.hi - range.lo) / 2, middle = range.lo + half;
  if (!std::isfinite(half))
    refuse("{}: its values of type {} go from {} to {}, more than a number can tell", path, name_of(v.type), range.lo,
           range.hi);
  for (size_t i = 0; i < count; ++i) {
    T wide;
    std::memcpy(&wide, bytes.data() + i * sizeof(T), sizeof wide);
    const auto value = fraction && half > 0 ? static_cast<float>((double(wide) - middle) / half)
                       : fraction           ? 0.0f
                                            : static_cast<float>(wide);
    std::memcpy(bytes.data() + i * sizeof value, &value, sizeof value);
  }
  if (fraction) v.offset += middle * v.scale, v.scale *= half > 0 ? half : 1;
  bytes.resize(count * sizeof(float));
  if (sizeof(T) > sizeof(float)) bytes.shrink_to_fit();
  v.type = VoxelType::kF32;
}

Volume volume_of(const VolumeFileHeader& h, std::vector<std::byte> bytes, const std::string& path) {
  if (bytes.size() != h.voxel_bytes())
    refuse("{}: {} bytes of voxels, its header says {}", path, bytes.size(), h.voxel_bytes());
  if (h.big_endian == (std::endian::native == std::endian::little) && h.encoding != Encoding::kText)
    swap_bytes(bytes, h.stored);
  Volume v;
  v.type = h.stored, v.scale = h.scale, v.offset = h.offset;
  with_type(h.stored, [&](auto value) {
    using T = decltype(value);
    if constexpr (sizeof(T) > 2 && !std::is_same_v<T, float>) narrow<T>(bytes, path, v);
  });
  v.size = {int(h.size[0]), int(h.size[1]), int(h.size[2])};
  v.index_to_data = h.index_to_data;
  v.unit = h.unit;
  v.space = h.space;
  v.stored = std::move(bytes);
  v.format = h.format;
  v.array = h.array;
  const Range range =
      with_type(v.type, [&](auto value) { return range_of<decltype(value)>(v.stored.data(), h.voxels()); });
  if (range.not_finite == h.voxels()) refuse("{}: none of its {} values is finite", path, h.voxels());
  v.not_finite = range.not_finite;
  v.lo = std::min(range.lo * v.scale, range.hi * v.scale) + v.offset;
  v.hi = std::max(range.lo * v.scale, range.hi * v.scale) + v.offset;
  // Air is -1000 and bone above 300; no other scale has integers that far on both sides.
  v.hounsfield = h.ct || (v.type != VoxelType::kF32 && v.lo <= -500 && v.lo >= -32768 && v.hi >= 300);
  return v;
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
  return or_error([&] {
    std::vector<std::byte> out;
    out.reserve(h.voxel_bytes());  // address space; pages come with the data
    for (size_t i = 0; i < h.parts(); ++i)
      read_part(h, i == 0 ? h.data_path : h.more_paths[i - 1], path, progress, out);
    return out;
  });
}

Result<Volume> make_volume(const VolumeFileHeader& h, std::vector<std::byte> bytes, const std::string& path) {
  return or_error([&] { return volume_of(h, std::move(bytes), path); });
}

}  // namespace telesplat::data
