#include "services/data/volume/volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <set>

#include "services/data/base/mapped_file.h"
#include "services/data/base/refusal.h"
#include "services/data/import/process.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {
namespace {

using Bytes = std::vector<std::byte>;

constexpr size_t kLayersAtOnce = 64;

bool needs_gdcm(const DicomSlice& s) { return s.data.compressed || s.pixels.components == 3; }

// Decodes slices by GDCM, all of one size: returns all frames of their files, by file.
std::map<std::string, Bytes> decode(const std::map<std::string, const DicomSlice*>& files, const std::string& path) {
  std::map<std::string, Bytes> out;
  if (files.empty()) return out;
  const DicomSlice& any = *files.begin()->second;
  const size_t bytes = stored_bytes(any.pixels.stored_type()),
               frame_bytes = size_t(any.pixels.columns) * size_t(any.pixels.rows) * bytes;
  uint64_t frames = 0;
  for (const auto& [name, slice] : files) frames += uint64_t(slice->frames);
  std::vector<std::string> paths;
  for (const auto& [name, slice] : files) paths.push_back(name);
  const uint64_t unpacked = frames * frame_bytes;
  const std::vector<std::string> words{"dicom", path, std::to_string(unpacked * uint64_t(any.pixels.components))};
  const auto received = need(import_volume("GDCM's", words, paths, unpacked, nullptr));
  const VolumeFileHeader& h = received.header;
  if (h.size != std::array<int64_t, 3>{any.pixels.columns, any.pixels.rows, int64_t(frames)} ||
      stored_bytes(h.stored) != bytes)
    refuse("{}: GDCM finds {} x {} x {} pixels of {} bytes, the header says {} x {} x {} of {}", path, h.size[0],
           h.size[1], h.size[2], stored_bytes(h.stored), any.pixels.columns, any.pixels.rows, frames, bytes);
  const std::byte* from = received.bytes.data();
  for (const auto& [name, slice] : files) {
    const std::byte* end = from + size_t(slice->frames) * frame_bytes;
    out[name] = Bytes(from, end), from = end;
  }
  return out;
}

// Stored pixels of slices. Keeps GDCM's results as long as layers need them, and the file that was read last.
class Pixels {
 public:
  explicit Pixels(const std::string& path) : path_(path) {}

  // Decodes all of these slices that need GDCM, in one run of the program.
  void prepare(const std::vector<const DicomSlice*>& slices) {
    std::map<std::string, const DicomSlice*> missing;
    std::set<std::string> needed;
    for (const DicomSlice* s : slices) {
      if (!needs_gdcm(*s)) continue;
      needed.insert(s->path);
      if (!decoded_.contains(s->path)) missing[s->path] = s;
    }
    std::erase_if(decoded_, [&](const auto& d) { return !needed.contains(d.first); });
    auto more = decode(missing, path_);
    decoded_.merge(more);
  }

  const std::byte* of(const DicomSlice& s) {
    const size_t bytes = size_t(s.pixels.rows) * size_t(s.pixels.columns) * stored_bytes(s.pixels.stored_type());
    if (needs_gdcm(s)) return decoded_[s.path].data() + size_t(s.frame) * bytes;
    if (s.path != name_) {
      file_ = need(MappedFile::open(s.path));
      if (s.data.deflated) {
        inflated_ = need(inflate_dicom(file_->text(), s.path));
      }
      name_ = s.path;
    }
    const std::string_view content = s.data.deflated ? std::string_view(inflated_) : file_->text();
    if (s.data.at > content.size() || bytes > content.size() - s.data.at)
      refuse("{}: changed while it was read", s.path);
    return reinterpret_cast<const std::byte*>(content.data()) + s.data.at;
  }

 private:
  const std::string& path_;
  std::map<std::string, Bytes> decoded_;
  std::string name_, inflated_;
  std::shared_ptr<const MappedFile> file_;
};

// Returns a stored value without the unused bits beside its own, and inverted if asked for.
template <class T>
T value_of(T raw, int up, int down, bool inverted) {
  if constexpr (std::is_integral_v<T>) {
    using Raw = std::make_unsigned_t<T>;
    // Shifts to the top and back: this extends the sign, or clears the bits.
    const T value = T(T(Raw(raw) << up) >> down);
    return !inverted ? value : std::is_signed_v<T> ? T(~value) : T(Raw(Raw(~Raw(0)) >> down) - value);
  } else {
    return raw;
  }
}

// Returns the shown values of padding: from, to.
template <class T>
std::optional<std::pair<T, T>> padding_of(const DicomSlice& s) {
  if constexpr (std::is_integral_v<T> && sizeof(T) <= 2) {
    const DicomPixels& p = s.pixels;
    if (!p.padding) return std::nullopt;
    const T a = T(*p.padding), b = T(p.padding_limit.value_or(*p.padding));
    const int unused = p.bits_allocated - p.bits_stored;
    const T from = value_of<T>(a, unused, unused, is_inverted(s)), to = value_of<T>(b, unused, unused, is_inverted(s));
    return std::minmax(from, to);
  }
  return std::nullopt;
}

template <class T>
void unpack(const DicomSlice& s, const std::byte* from, size_t count, std::byte* to, bool rescale) {
  const DicomPixels& p = s.pixels;
  const int high = p.high_bit.value_or(p.bits_stored - 1);
  const int up = p.bits_allocated - 1 - high, down = p.bits_allocated - p.bits_stored;
  const bool inverted = is_inverted(s), swap = s.data.big_endian && !needs_gdcm(s);
  const auto padding = padding_of<T>(s);
  for (size_t i = 0; i < count; ++i) {
    std::byte bytes[sizeof(T)];
    std::memcpy(bytes, from + i * sizeof(T), sizeof(T));
    if (swap) std::reverse(bytes, bytes + sizeof(T));
    T raw;
    std::memcpy(&raw, bytes, sizeof(T));
    const T value = value_of<T>(raw, up, down, inverted);
    if (!rescale) {
      std::memcpy(to + i * sizeof value, &value, sizeof value);
      continue;
    }
    const bool padded = padding && value >= padding->first && value <= padding->second;
    const float scaled =
        padded ? std::numeric_limits<float>::quiet_NaN() : float(double(value) * p.slope + p.intercept);
    std::memcpy(to + i * sizeof scaled, &scaled, sizeof scaled);
  }
}

template <class T>
void mix(const Bytes& below, const Bytes& above, double share, std::byte* to) {
  for (size_t at = 0; at < below.size(); at += sizeof(T)) {
    T a, b;
    std::memcpy(&a, below.data() + at, sizeof(T));
    std::memcpy(&b, above.data() + at, sizeof(T));
    const double mixed = double(a) * (1 - share) + double(b) * share;
    const T value = std::is_integral_v<T> ? T(std::llround(mixed)) : T(mixed);
    std::memcpy(to + at, &value, sizeof(T));
  }
}

// Padding far from all other values would take most of their range: it becomes the lowest of them.
template <class T>
void take_padding(const DicomSlice& s, Bytes& bytes, std::string& remark) {
  const auto padding = padding_of<T>(s);
  if (!padding) return;
  T* const voxels = reinterpret_cast<T*>(bytes.data());
  const size_t count = bytes.size() / sizeof(T);
  T lo = std::numeric_limits<T>::max(), hi = std::numeric_limits<T>::lowest();
  size_t padded = 0;
  for (size_t i = 0; i < count; ++i) {
    const bool is = voxels[i] >= padding->first && voxels[i] <= padding->second;
    padded += is;
    if (!is) lo = std::min(lo, voxels[i]), hi = std::max(hi, voxels[i]);
  }
  const double away = std::max(double(lo) - double(padding->second), double(padding->first) - double(hi));
  if (padded == 0 || padded == count || away <= 0.01 * (double(hi) - double(lo))) return;
  for (size_t i = 0; i < count; ++i)
    if (voxels[i] >= padding->first && voxels[i] <= padding->second) voxels[i] = s.pixels.slope < 0 ? hi : lo;
  remark += fmt::format("{}{} voxels are padding ({}) and count as the lowest value", remark.empty() ? "" : "; ",
                        padded, double(padding->first) * s.pixels.slope + s.pixels.intercept);
}

void fill(const DicomSeries& series, size_t step, const std::string& path, const ReadProgress& progress, Bytes& bytes) {
  const VolumeFileHeader& h = series.header;
  const size_t pixels = size_t(h.size[0]) * size_t(h.size[1]), layer_bytes = pixels * stored_bytes(h.stored);
  const auto& layers = series.order.steps[step];
  const auto& slices = series.order.slices;
  Pixels source(path);
  // Writes a slice as the volume stores it.
  const auto read = [&](const DicomSlice& s, std::byte* to) {
    const auto from = source.of(s);
    const bool rescale = h.stored == StoredType::kF32 && (s.pixels.stored_type() != h.stored ||
                                                          h.scale != s.pixels.slope || h.offset != s.pixels.intercept);
    with_type(s.pixels.stored_type(), [&](auto zero) { unpack<decltype(zero)>(s, from, pixels, to, rescale); });
  };
  Bytes below, above;
  for (size_t k = 0; k < layers.size(); ++k) {
    if (k % kLayersAtOnce == 0) {
      std::vector<const DicomSlice*> next;
      for (size_t n = k; n < std::min(k + kLayersAtOnce, layers.size()); ++n)
        for (const size_t i : {layers[n].below, layers[n].above}) next.push_back(&slices[i]);
      source.prepare(next);
    }
    const DicomLayer& l = layers[k];
    std::byte* const to = bytes.data() + k * layer_bytes;
    if (l.share == 0) {
      read(slices[l.below], to);
    } else {
      below.resize(layer_bytes), above.resize(layer_bytes);
      read(slices[l.below], below.data());
      read(slices[l.above], above.data());
      with_type(h.stored, [&](auto zero) { mix<decltype(zero)>(below, above, l.share, to); });
    }
    if (progress) progress(double(k + 1) / double(layers.size()));
  }
}

}  // namespace

Result<Volume> read_dicom(const DicomSeries& series, size_t step, const std::string& path,
                          const ReadProgress& progress) {
  const VolumeFileHeader& h = series.header;
  Bytes bytes(h.voxel_bytes());
  const Status filled = or_error([&] { fill(series, step, path, progress, bytes); });
  if (!filled) return filled.error();
  std::string remark = series.order.remark;
  with_type(h.stored, [&](auto zero) { take_padding<decltype(zero)>(series.order.slices[0], bytes, remark); });
  auto volume = make_volume(h, std::move(bytes), path);
  if (volume) volume->remark = remark;
  return volume;
}

}  // namespace telesplat::data
