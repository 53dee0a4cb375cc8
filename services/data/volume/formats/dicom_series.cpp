#include "services/data/volume/formats/dicom.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "common/volume/grid.h"
#include "services/data/base/mapped_file.h"
#include "services/data/base/numbered.h"
#include "services/data/base/refusal.h"
#include "services/data/volume/formats/header_text.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostSlices = 200'000;
constexpr int kDeepest = 8;

using Slices = std::vector<DicomSlice>;

struct Found {
  std::map<std::string, Slices> series;
  size_t slices = 0, damaged = 0;
  std::string damage;  // damage of the first such file
};

void scan(const std::string& path, Found& found) {
  const auto file = MappedFile::open(path);
  if (!file || !is_dicom((*file)->text())) return;
  auto slices = parse_dicom((*file)->text(), path);
  if (!slices) {
    if (found.damaged++ == 0) found.damage = slices.error().text;
    return;
  }
  found.slices += slices->size();
  if (slices->front().data.bytes > 0)
    for (DicomSlice& s : *slices) found.series[s.series].push_back(std::move(s));
}

// Reads all slices with pixels, grouped by series.
Found read_slices(const std::string& folder) {
  std::error_code error;
  for (const bool below : {fs::exists(folder + "/DICOMDIR", error), true}) {
    Found found;
    for (const std::string& path : need(files_of_folder(folder, below ? kDeepest : 1))) {
      scan(path, found);
      if (found.slices > kMostSlices) refuse("{}: holds more than {} slices", folder, kMostSlices);
    }
    if (!found.series.empty()) return found;
    if (found.damaged > 0) throw Refusal{found.damage};
    if (below) break;
  }
  refuse("{}: holds no DICOM slices", folder);
}

std::vector<DicomSeriesName> names_of(const std::vector<Slices>& all) {
  std::vector<DicomSeriesName> out;
  for (const Slices& slices : all) {
    const DicomSlice& any = slices.front();
    out.push_back({any.series, any.series_text, any.modality, slices.size(), any.pixels.columns, any.pixels.rows});
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

// Returns the index of the requested series.
size_t choose(const std::vector<DicomSeriesName>& all, const std::string& which, const std::string& folder) {
  if (which.empty())
    return size_t(std::max_element(all.begin(), all.end(), [](auto& a, auto& b) { return a.slices < b.slices; }) -
                  all.begin());
  for (size_t i = 0; i < all.size(); ++i)
    if (which == all[i].uid || which == std::to_string(i + 1)) return i;
  refuse("{}: --series {}: there is none of that place or UID; there are {}", folder, in_quotes(which), list_of(all));
}

void check_pixels(const DicomPixels& p, const std::string& path) {
  if (p.photometric == "PALETTE COLOR") refuse("{}: has a palette of colours; supported are values", path);
  if (p.components != 1 && (p.components != 3 || p.bits_allocated != 8))
    refuse("{}: has {} components of {} bits a pixel; supported are 1, and colours of 3 of 8 bits", path, p.components,
           p.bits_allocated);
  const bool whole = p.bits_allocated == 8 || p.bits_allocated == 16 || p.bits_allocated == 32;
  const bool real = p.bits_allocated == 32 || p.bits_allocated == 64;
  if (!(p.is_float ? real : whole && p.bits_stored >= 1 && p.bits_stored <= p.bits_allocated))
    refuse("{}: has {} bits a pixel in {}; supported are up to 8 in 8, 16 in 16 and 32 in 32", path, p.bits_stored,
           p.bits_allocated);
  if (!p.is_float &&
      (p.high_bit.value_or(p.bits_stored - 1) < p.bits_stored - 1 || p.high_bit.value_or(0) >= p.bits_allocated))
    refuse("{}: its highest bit is {}, with {} bits a pixel in {}", path, *p.high_bit, p.bits_stored, p.bits_allocated);
  if (p.rows < 1 || p.columns < 1 || p.rows > volume::kMaxSide || p.columns > volume::kMaxSide)
    refuse("{}: has {} x {} pixels, limits 1 and {}", path, p.columns, p.rows, volume::kMaxSide);
  if (!std::isfinite(p.slope) || !std::isfinite(p.intercept) || p.slope == 0)
    refuse("{}: its values are scaled by {} and shifted by {}", path, p.slope, p.intercept);
}

void check_slice(const DicomSlice& s) {
  const DicomPixels& p = s.pixels;
  if (s.data.syntax.starts_with("1.2.840.10008.1.2.4.10"))
    refuse("{}: is a film (transfer syntax {}), no volume", s.path, in_quotes(s.data.syntax));
  check_pixels(p, s.path);
  if (!s.data.compressed && p.photometric != "YBR_FULL_422" && s.data.bytes < p.bytes())
    refuse("{}: claims {} x {} pixels of {} bits ({} bytes), has {} bytes of them", s.path, p.columns, p.rows,
           p.bits_allocated, p.bytes(), s.data.bytes);
}

// True if two slices have equal pixels, as far as their files show without unpacking.
bool same_pixels(const DicomSlice& a, const DicomSlice& b) {
  if (a.data.deflated || b.data.deflated || a.data.bytes != b.data.bytes || (a.data.compressed && a.frames > 1))
    return false;
  const auto file = MappedFile::open(a.path), other = MappedFile::open(b.path);
  if (!file || !other || a.data.at + a.data.bytes > (*file)->text().size()) return false;
  return (*file)->text().substr(a.data.at, a.data.bytes) ==
         (*other)->text().substr(std::min<size_t>(b.data.at, (*other)->text().size()), b.data.bytes);
}

// Returns the header common to all steps. If slices are stored or scaled differently, all become f32.
VolumeFileHeader header_of(const DicomOrder& order) {
  const DicomSlice& first = order.slices.front();
  VolumeFileHeader h;
  h.format = "dicom";
  h.size = {first.pixels.columns, first.pixels.rows, int64_t(order.steps[0].size())};
  h.index_to_data = placement(first.plane.along_row * first.plane.spacing.x,
                              first.plane.along_column * first.plane.spacing.y, order.step, order.origin);
  h.unit = "mm";
  h.space = scene::Space::kLps;
  h.ct = first.modality == "CT";
  const DicomPixels& stored = first.pixels;
  const bool even = std::all_of(order.slices.begin(), order.slices.end(), [&](const DicomSlice& s) {
    return s.pixels.is_stored_as(stored) && is_inverted(s) == is_inverted(first);
  });
  h.stored = even ? stored.stored_type() : StoredType::kF32;
  if (even) h.scale = stored.slope, h.offset = stored.intercept;
  return h;
}

void say_values(DicomSeries& series) {
  const DicomSlice& first = series.order.slices.front();
  std::string& remark = series.order.remark;
  if (first.pixels.components == 3) say(remark, "colours are shown as their brightness");
  if (is_inverted(first)) say(remark, "low values are bright in the file (MONOCHROME1), and were turned round");
  if (first.pixels.photometric == "MONOCHROME1" && !is_inverted(first))
    say(remark, "low values are bright in the file (MONOCHROME1); values are kept");
}

std::shared_ptr<const DicomSeries> series_at(const std::string& path, const std::string& which) {
  std::error_code error;
  std::string folder = path, wanted = which;
  bool lone = false;
  if (!fs::is_directory(path, error)) {
    const auto file = need(MappedFile::open(path));
    const auto slices = need(parse_dicom(file->text(), path));
    const fs::path parent = fs::path(path).parent_path();
    folder = parent.empty() ? "." : parent.string();
    if (slices.front().data.bytes > 0) wanted = slices.front().series;
    lone = slices.front().plane.stacked;
  }
  auto found = read_slices(folder);
  if (lone)  // an ultrasound film: other files of its series are other films
    std::erase_if(found.series[wanted], [&](const DicomSlice& s) { return !fs::equivalent(s.path, path, error); });
  std::vector<Slices> all;
  for (auto& [uid, slices] : found.series)
    if (!slices.empty()) all.push_back(std::move(slices));
  std::stable_sort(all.begin(), all.end(),
                   [](auto& a, auto& b) { return a.front().series_number < b.front().series_number; });
  auto series = std::make_shared<DicomSeries>();
  series->all = names_of(all);
  if (all.empty()) refuse("{}: changed while it was read", path);
  const size_t taken = series->taken = choose(series->all, wanted, folder);
  std::string remark;
  if (all.size() > 1)
    remark = fmt::format("the folder holds {} series ({}); series {} was taken{}", all.size(), list_of(series->all),
                         taken + 1, wanted.empty() ? ", which has the most slices; --series takes another" : "");
  if (found.damaged > 0) say(remark, fmt::format("left out {} damaged files ({})", found.damaged, found.damage));
  series->order = order_slices(std::move(all[taken]), same_pixels);
  if (!series->order.remark.empty()) say(remark, series->order.remark);
  series->order.remark = remark;
  for (const DicomSlice& s : series->order.slices) check_slice(s);
  say_values(*series);
  series->header = header_of(series->order);
  const VolumeFileHeader& h = series->header;
  need(check_header(h, h.voxel_bytes(), folder));
  return series;
}

}  // namespace

StoredType DicomPixels::stored_type() const {
  if (is_float) return bits_allocated == 32 ? StoredType::kF32 : StoredType::kF64;
  if (components == 3) return StoredType::kU8;
  return whole_type(bits_allocated > 16 ? 4 : size_t(bits_allocated) / 8, is_signed);
}

bool is_inverted(const DicomSlice& s) {
  return s.pixels.photometric == "MONOCHROME1" && s.pixels.slope == 1 && s.pixels.intercept == 0 &&
         s.modality != "CT" && s.modality != "PT";
}

std::vector<std::string> DicomSeries::files() const {
  std::vector<std::string> out;
  for (const DicomSlice& s : order.slices) out.push_back(s.path);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

std::string text_of(const DicomSeriesName& series, size_t place) {
  // Texts from files: shortened, and without characters that a terminal would obey.
  const auto plain = [](const std::string& said) {
    const std::string quoted = in_quotes(said);
    return said.empty() ? "" : quoted.substr(1, quoted.size() - 2) + ", ";
  };
  return fmt::format("{}: {}{}{} slices of {} x {}", place + 1, plain(series.text), plain(series.modality),
                     series.slices, series.columns, series.rows);
}

bool holds_dicom(const std::string& folder) {
  const auto is_slice = [](const std::string& path) {
    const auto file = MappedFile::open(path);
    return file && is_dicom((*file)->text());
  };
  for (const int levels : {1, kDeepest}) {
    const auto files = files_of_folder(folder, levels);
    if (!files) return false;
    if (std::any_of(files->begin(), files->end(), is_slice)) return true;
  }
  return false;
}

Result<std::shared_ptr<const DicomSeries>> find_dicom_series(const std::string& path, const std::string& which) {
  return or_error([&] { return series_at(path, which); });
}

}  // namespace telesplat::data
