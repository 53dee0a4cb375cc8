#include "services/data/volume/formats/dicom_series.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <glm/geometric.hpp>
#include <map>

#include "common/volume/grid.h"
#include "services/data/base/mapped_file.h"
#include "services/data/volume/formats/header_text.h"
#include "services/data/volume/formats/payload.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostFiles = 100'000;  // in a folder
constexpr double kMostUneven = 1.5;     // largest distance of neighbouring slices by the smallest
constexpr double kSamePlace = 1e-3;     // of a pixel

std::string file_name(const std::string& path) { return fs::path(path).filename().string(); }

using Slices = std::vector<DicomSlice>;

// All slices with pixels, a series each, by number and UID.
Result<std::vector<Slices>> read_slices(const std::string& folder) {
  std::map<std::string, Slices> series;
  std::error_code error;
  std::vector<std::string> paths;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->is_regular_file(error) && !file_name(entry->path().string()).starts_with('.'))
      paths.push_back(entry->path().string());
    if (paths.size() > kMostFiles) return Error{fmt::format("{}: holds more than {} files", folder, kMostFiles)};
  }
  if (error) return Error{fmt::format("{}: cannot be read: {}", folder, error.message())};
  std::sort(paths.begin(), paths.end());
  for (const std::string& path : paths) {
    const auto file = MappedFile::open(path);
    if (!file || (*file)->text().size() < 132 || (*file)->text().substr(128, 4) != "DICM") continue;
    auto slice = parse_dicom((*file)->text(), path);
    if (!slice) return slice.error();
    if (slice->data_bytes > 0) series[slice->series].push_back(std::move(*slice));
  }
  if (series.empty()) return Error{folder + ": holds no DICOM slices"};
  std::vector<Slices> out;
  for (auto& [uid, slices] : series) out.push_back(std::move(slices));
  std::stable_sort(out.begin(), out.end(),
                   [](auto& a, auto& b) { return a.front().series_number < b.front().series_number; });
  return out;
}

std::vector<DicomSeriesName> names_of(const std::vector<Slices>& all) {
  std::vector<DicomSeriesName> out;
  for (const Slices& slices : all) {
    const DicomSlice& any = slices.front();
    out.push_back({any.series, any.series_text, any.modality, slices.size(), any.columns, any.rows});
  }
  return out;
}

std::string list_of(const std::vector<DicomSeriesName>& all) {
  constexpr size_t kMostNamed = 12;
  std::string out;
  for (size_t i = 0; i < std::min(all.size(), kMostNamed); ++i)
    out += fmt::format("{}{}", i > 0 ? "; " : "", text_of(all[i], i));
  return all.size() > kMostNamed ? fmt::format("{}; and {} more", out, all.size() - kMostNamed) : out;
}

// The place of the series that was asked for.
Result<size_t> choose(const std::vector<DicomSeriesName>& all, const std::string& which, const std::string& folder) {
  if (which.empty())
    return size_t(std::max_element(all.begin(), all.end(), [](auto& a, auto& b) { return a.slices < b.slices; }) -
                  all.begin());
  for (size_t i = 0; i < all.size(); ++i)
    if (which == all[i].uid || which == std::to_string(i + 1)) return i;
  return Error{fmt::format("{}: --series {}: there is none of that place or UID; there are {}", folder,
                           in_quotes(which), list_of(all))};
}

Status check_slice(const DicomSlice& s, const DicomSlice& first) {
  if (s.frames != 1) return Error{fmt::format("{}: has {} frames, supported is one a file", s.path, s.frames)};
  if (s.components != 1)
    return Error{fmt::format("{}: has {} components a pixel, supported is 1", s.path, s.components)};
  if ((s.bits_allocated != 8 && s.bits_allocated != 16) || s.bits_stored < 1 || s.bits_stored > s.bits_allocated)
    return Error{fmt::format("{}: has {} bits a pixel in {}; supported are up to 8 in 8 and up to 16 in 16", s.path,
                             s.bits_stored, s.bits_allocated)};
  if (s.rows < 1 || s.columns < 1 || s.rows > volume::kMaxSide || s.columns > volume::kMaxSide)
    return Error{fmt::format("{}: has {} x {} pixels, limits 1 and {}", s.path, s.columns, s.rows, volume::kMaxSide)};
  const uint64_t bytes = uint64_t(s.rows) * uint64_t(s.columns) * uint64_t(s.bits_allocated / 8);
  if (s.data_bytes < bytes)
    return Error{fmt::format("{}: claims {} x {} pixels of {} bits ({} bytes), has {} bytes of them", s.path, s.columns,
                             s.rows, s.bits_allocated, bytes, s.data_bytes)};
  if (s.rows != first.rows || s.columns != first.columns)
    return Error{fmt::format("{}: has {} x {} pixels, {} of the same series has {} x {}", s.path, s.columns, s.rows,
                             file_name(first.path), first.columns, first.rows)};
  if (s.bits_allocated != first.bits_allocated || s.bits_stored != first.bits_stored ||
      s.is_signed != first.is_signed || s.big_endian != first.big_endian)
    return Error{
        fmt::format("{}: stores pixels in another way than {} of the same series", s.path, file_name(first.path))};
  if (glm::distance(s.along_row, first.along_row) > 1e-3 || glm::distance(s.along_column, first.along_column) > 1e-3 ||
      glm::distance(s.spacing, first.spacing) > 1e-3 * glm::length(first.spacing))
    return Error{
        fmt::format("{}: is turned or spaced otherwise than {} of the same series", s.path, file_name(first.path))};
  if (s.position.has_value() != first.position.has_value())
    return Error{fmt::format("{}: one of it and {} of the same series has a position, one has none", s.path,
                             file_name(first.path))};
  if (!std::isfinite(s.slope) || !std::isfinite(s.intercept) || s.slope == 0)
    return Error{fmt::format("{}: its values are scaled by {} and shifted by {}", s.path, s.slope, s.intercept)};
  return ok_status();
}

// Sorts slices; returns the step from one to the next.
Result<glm::dvec3> order(DicomSeries& series, const std::string& folder) {
  auto& slices = series.slices;
  const DicomSlice& any = slices.front();
  const glm::dvec3 normal = glm::cross(any.along_row, any.along_column);
  const double said = any.slice_spacing > 0 ? any.slice_spacing : any.thickness > 0 ? any.thickness : 1;
  if (!any.position) {
    std::stable_sort(slices.begin(), slices.end(), [](auto& a, auto& b) { return a.instance < b.instance; });
    return normal * said;
  }
  const auto height = [&](const DicomSlice& s) { return glm::dot(*s.position, normal); };
  std::stable_sort(slices.begin(), slices.end(), [&](auto& a, auto& b) { return height(a) < height(b); });
  if (slices.size() == 1) return normal * said;
  double least = HUGE_VAL, most = 0;
  size_t widest = 1;
  for (size_t k = 1; k < slices.size(); ++k) {
    const double gap = height(slices[k]) - height(slices[k - 1]);
    if (!(gap > kSamePlace * std::abs(any.spacing.x)))
      return Error{fmt::format("{}: {} and {} lie at the same place (several time steps or series in one folder?)",
                               folder, file_name(slices[k - 1].path), file_name(slices[k].path))};
    least = std::min(least, gap);
    if (gap > most) most = gap, widest = k;
  }
  if (most > kMostUneven * least)
    return Error{fmt::format("{}: slices are missing: {} and {} are {:.3g} apart, others {:.3g}", folder,
                             file_name(slices[widest - 1].path), file_name(slices[widest].path), most, least)};
  if (most > 1.01 * least)
    series.remark += (series.remark.empty() ? "" : "; ") +
                     fmt::format("slices are {:.4g} to {:.4g} apart and were evened", least, most);
  return (*slices.back().position - *slices.front().position) / double(slices.size() - 1);
}

template <class T>
void unpack(const DicomSlice& s, const std::byte* from, size_t count, std::byte* to, bool rescale) {
  const unsigned unused = unsigned(s.bits_allocated - s.bits_stored);
  const auto* bytes = reinterpret_cast<const unsigned char*>(from);
  for (size_t i = 0; i < count; ++i) {
    std::make_unsigned_t<T> raw;
    if constexpr (sizeof(T) == 1)
      raw = bytes[i];
    else
      raw = uint16_t(s.big_endian ? bytes[2 * i] << 8 | bytes[2 * i + 1] : bytes[2 * i + 1] << 8 | bytes[2 * i]);
    // Up to the top and back: brings the sign along, or zeroes.
    const T value = T(T(std::make_unsigned_t<T>(raw << unused)) >> unused);
    if (rescale) {
      const float scaled = float(value * s.slope + s.intercept);
      std::memcpy(to + i * sizeof scaled, &scaled, sizeof scaled);
    } else {
      std::memcpy(to + i * sizeof value, &value, sizeof value);
    }
  }
}

}  // namespace

std::string text_of(const DicomSeriesName& series, size_t place) {
  // What files say: cut, and without what a terminal might obey.
  const auto plain = [](const std::string& said) {
    const std::string quoted = in_quotes(said);
    return said.empty() ? "" : quoted.substr(1, quoted.size() - 2) + ", ";
  };
  return fmt::format("{}: {}{}{} slices of {} x {}", place + 1, plain(series.text), plain(series.modality),
                     series.slices, series.columns, series.rows);
}

Result<DicomSeries> find_dicom_series(const std::string& folder, const std::string& which) {
  auto all = read_slices(folder);
  if (!all) return all.error();
  DicomSeries series;
  series.all = names_of(*all);
  const auto taken = choose(series.all, which, folder);
  if (!taken) return taken.error();
  series.taken = *taken;
  series.slices = std::move((*all)[*taken]);
  if (all->size() > 1)
    series.remark =
        fmt::format("the folder holds {} series ({}); series {} was taken{}", all->size(), list_of(series.all),
                    *taken + 1, which.empty() ? ", which has the most slices; --series takes another" : "");
  for (const DicomSlice& s : series.slices)
    if (auto status = check_slice(s, series.slices.front()); !status) return status.error();
  const auto step = order(series, folder);
  if (!step) return step.error();

  const DicomSlice& first = series.slices.front();
  VolumeFileHeader& h = series.header;
  h.format = "dicom";
  h.size = {first.columns, first.rows, int64_t(series.slices.size())};
  h.index_to_data = placement(first.along_row * first.spacing.x, first.along_column * first.spacing.y, *step,
                              first.position.value_or(glm::dvec3(0)));
  h.unit = "mm";
  h.space = scene::Space::kLps;
  h.ct = first.modality == "CT";
  const bool even = std::all_of(series.slices.begin(), series.slices.end(), [&](const DicomSlice& s) {
    return s.slope == first.slope && s.intercept == first.intercept;
  });
  if (even) {
    h.scale = first.slope, h.offset = first.intercept;
    h.stored = first.bits_allocated == 8 ? (first.is_signed ? StoredType::kI8 : StoredType::kU8)
                                         : (first.is_signed ? StoredType::kI16 : StoredType::kU16);
  } else {
    h.stored = StoredType::kF32;
  }
  if (auto status = check_header(h, h.voxel_bytes(), folder); !status) return status.error();
  return series;
}

Result<Volume> read_dicom(const std::string& folder, const std::string& which, const ReadProgress& progress) {
  const auto series = find_dicom_series(folder, which);
  if (!series) return series.error();
  const VolumeFileHeader& h = series->header;
  if (auto status = check_memory(h.voxel_bytes(), folder); !status) return status.error();
  const size_t pixels = size_t(h.size[0]) * size_t(h.size[1]);
  const size_t slice_bytes = pixels * stored_bytes(h.stored);
  const bool rescale = h.stored == StoredType::kF32;
  std::vector<std::byte> bytes(h.voxel_bytes());
  for (size_t k = 0; k < series->slices.size(); ++k) {
    const DicomSlice& s = series->slices[k];
    const auto file = MappedFile::open(s.path);
    if (!file) return file.error();
    const size_t needed = pixels * size_t(s.bits_allocated / 8);
    if (s.data_at + needed > (*file)->bytes().size()) return Error{s.path + ": changed while it was read"};
    const std::byte* from = (*file)->bytes().data() + s.data_at;
    std::byte* to = bytes.data() + k * slice_bytes;
    if (s.bits_allocated == 8 && s.is_signed) unpack<int8_t>(s, from, pixels, to, rescale);
    if (s.bits_allocated == 8 && !s.is_signed) unpack<uint8_t>(s, from, pixels, to, rescale);
    if (s.bits_allocated == 16 && s.is_signed) unpack<int16_t>(s, from, pixels, to, rescale);
    if (s.bits_allocated == 16 && !s.is_signed) unpack<uint16_t>(s, from, pixels, to, rescale);
    if (progress) progress(double(k + 1) / double(series->slices.size()));
  }
  auto volume = make_volume(h, std::move(bytes), folder);
  if (volume) volume->remark = series->remark;
  return volume;
}

}  // namespace telesplat::data
