#include "services/data/volume/formats/stack.h"

#include <cmath>
#include <set>

#include "common/core/within.h"
#include "services/data/base/mapped_file.h"
#include "services/data/volume/formats/header_text.h"

namespace telesplat::data {
namespace {

constexpr std::string_view kPng("\x89PNG\r\n\x1a\n", 8);

bool is_tiff(std::string_view start) {
  using namespace std::string_view_literals;
  return start.starts_with("II*\0"sv) || start.starts_with("MM\0*"sv) || start.starts_with("II+\0"sv) ||
         start.starts_with("MM\0+"sv);
}

// Returns one page, from a PNG's first chunk. Source: W3C, "Portable Network Graphics", 11.2.2.
TiffPages pages_of_png(std::string_view content) {
  const auto byte = [&](size_t at) {
    return at < content.size() ? int64_t(static_cast<unsigned char>(content[at])) : 0;
  };
  const auto size = [&](size_t at) { return byte(at) << 24 | byte(at + 1) << 16 | byte(at + 2) << 8 | byte(at + 3); };
  TiffPages out;
  out.width = size(16), out.height = size(20), out.pages = 1;
  const int64_t bits = byte(24), colours = byte(25);
  out.channels = colours == 0 ? 1 : colours == 4 ? 2 : 3;
  if (bits <= 8) out.type = StoredType::kU8;
  if (bits == 16) out.type = StoredType::kU16;
  return out;
}

TiffPages pages_of(const std::string& path) {
  const auto file = need(MappedFile::open(path));
  const std::string_view content = file->text();
  const auto pages = content.starts_with(kPng) ? std::optional(pages_of_png(content)) : tiff_pages(content);
  if (!pages) refuse("{}: is a damaged TIFF file, or is none", path);
  if (pages->channels != 1)
    refuse("{}: has {} channels a pixel; slices of a volume have one, of grey", path, pages->channels);
  if (!pages->type) refuse("{}: its pixels are of a type that is not read; {}", path, kSupportedTypes);
  return *pages;
}

VolumeFileHeader header_of(const std::vector<std::string>& files) {
  VolumeFileHeader h;
  h.format = "stack";
  for (const std::string& path : files) {
    const TiffPages pages = pages_of(path);
    if (path == files[0]) {
      h.size = {pages.width, pages.height, 0};
      h.stored = *pages.type;
      h.big_endian = pages.big_endian;
      h.unit = pages.unit.substr(0, scene::kMaxUnit);
      h.index_to_data = placement(pages.spacing);
      h.data_path = path, h.data_at = pages.data_at;
    }
    if (pages.width != h.size[0] || pages.height != h.size[1] || *pages.type != h.stored)
      refuse("{}: is a picture of {} x {} of {}, the first slice, {}, has {} x {} of {}", path, pages.width,
             pages.height, name_of(*pages.type), files[0], h.size[0], h.size[1], name_of(h.stored));
    h.size[2] += pages.pages;
  }
  return h;
}

constexpr int64_t kMostSide = 1 << 16;
constexpr int64_t kMostPages = 100'000;
constexpr uint64_t kMostEntries = 10'000'000;

class Walker {
 public:
  explicit Walker(std::string_view content) : content_(content) {}

  std::optional<TiffPages> walk() {
    const std::string_view start = content_.substr(0, 4);
    using namespace std::string_view_literals;
    big_endian_ = start.starts_with("MM");
    large_ = start == "II+\0"sv || start == "MM\0+"sv;
    if (!large_ && start != "II*\0"sv && start != "MM\0*"sv) return std::nullopt;
    std::set<uint64_t> seen;
    for (uint64_t at = large_ ? number(8, 8) : number(4, 4); at != 0;)
      if (int64_t(seen.size()) == kMostPages || entries_ > kMostEntries || !seen.insert(at).second || !directory(at))
        return std::nullopt;
    if (out_.pages == 0) return std::nullopt;
    if (out_.pages == 1 && listed_ > 1) out_.pages = listed_, out_.data_at = listed_at_;
    out_.big_endian = big_endian_;
    return out_;
  }

 private:
  struct Page {
    uint64_t subfile = 0, width = 0, height = 0, bits = 1, compression = 1, strip = 0, samples = 1, format = 1;
    double x_resolution = 0, y_resolution = 0;
    bool placed = false;
    std::string_view description;
  };

  // TIFF's tags, by number.
  static constexpr std::pair<uint64_t, uint64_t Page::*> kNumbers[] = {
      {254, &Page::subfile},     {256, &Page::width}, {257, &Page::height},  {258, &Page::bits},
      {259, &Page::compression}, {273, &Page::strip}, {277, &Page::samples}, {339, &Page::format}};

  bool inside(uint64_t at, uint64_t bytes) const { return at <= content_.size() && bytes <= content_.size() - at; }

  uint64_t number(uint64_t at, size_t bytes) const {
    if (!inside(at, bytes)) return 0;
    uint64_t out = 0;
    for (size_t i = 0; i < bytes; ++i)
      out |= uint64_t(static_cast<unsigned char>(content_[at + (big_endian_ ? bytes - 1 - i : i)])) << 8 * i;
    return out;
  }

  static size_t bytes_of(uint64_t type) {
    constexpr size_t kBytes[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 0, 0, 8, 8, 8};
    return type < std::size(kBytes) ? kBytes[type] : 0;
  }

  void entry(uint64_t at, Page& page) const {
    const uint64_t tag = number(at, 2), type = number(at + 2, 2), count = number(at + 4, large_ ? 8 : 4);
    const size_t each = bytes_of(type), room = large_ ? 8 : 4;
    uint64_t value_at = at + (large_ ? 12 : 8);
    if (each == 0 || count == 0 || count > content_.size() / each) return;
    if (each * count > room) value_at = number(value_at, room);
    if (!inside(value_at, each * count)) return;
    const uint64_t value = number(value_at, each);
    const double ratio = type == 5 ? double(number(value_at, 4)) / double(number(value_at + 4, 4)) : 0;
    for (const auto& [known, to] : kNumbers)
      if (tag == known) page.*to = value;
    if (tag == 270) page.description = content_.substr(value_at, count);
    if (tag == 282) page.x_resolution = ratio;
    if (tag == 283) page.y_resolution = ratio;
    if (tag == 33550 || tag == 34735) page.placed = true;  // GeoTIFF's pixel scale and keys
  }

  // Reads the directory at `at`, and sets `at` to the next one.
  bool directory(uint64_t& at) {
    const uint64_t count = number(at, large_ ? 8 : 2), entry_bytes = large_ ? 20 : 12;
    const uint64_t first = at + (large_ ? 8 : 2);
    if (count == 0 || count > 65'535 || !inside(first, count * entry_bytes + (large_ ? 8 : 4))) return false;
    Page page;
    entries_ += count;
    for (uint64_t i = 0; i < count; ++i) entry(first + i * entry_bytes, page);
    at = number(first + count * entry_bytes, large_ ? 8 : 4);
    take(page);
    return true;
  }

  void take(const Page& page) {
    if (page.subfile & 5) return;  // a reduced copy, or a mask
    if (out_.pages > 0) {
      out_.pages += int64_t(page.width) == out_.width && int64_t(page.height) == out_.height;
      return;
    }
    out_.pages = 1;
    out_.width = int64_t(page.width), out_.height = int64_t(page.height);
    out_.channels = int(std::min<uint64_t>(page.samples, 1000));
    out_.placed = page.placed;
    if (out_.width > kMostSide || out_.height > kMostSide) return;
    out_.type = type_of(page);
    // Pixels per centimetre or inch; ImageJ writes pixels per its own unit.
    const auto spacing = [](double resolution) {
      return resolution > 0 && std::isfinite(resolution) ? 1 / resolution : 1;
    };
    const auto said = [&](std::string_view key) { return line_of(page.description, key); };
    if (!page.description.starts_with("ImageJ=")) return;
    out_.unit = said("unit=");
    if (out_.unit == "pixel" || out_.unit == "pixels") out_.unit.clear();
    out_.spacing = {spacing(page.x_resolution), spacing(page.y_resolution),
                    std::abs(data::number(said("spacing=")).value_or(1))};
    if (!(out_.spacing.z > 0)) out_.spacing.z = 1;
    // ImageJ's channels or frames alone count as slices; two of slices, frames and channels do not.
    const auto several = [&](std::string_view key) { return data::number(said(key)).value_or(1) > 1; };
    const int axes = several("slices=") + several("frames=") + several("channels=");
    if (axes > 1) out_.channels = int(within(data::number(said("images=")).value_or(2), 2.0, 1e6));
    const auto images = data::number(said("images="));
    if (!images || !(*images > 1 && *images <= double(kMostPages)) || page.compression != 1 || !out_.type) return;
    const auto pages = int64_t(*images);
    if (inside(page.strip, uint64_t(pages) * uint64_t(out_.width) * uint64_t(out_.height) * stored_bytes(*out_.type)))
      listed_ = pages, listed_at_ = page.strip;
  }

  static std::string line_of(std::string_view text, std::string_view key) {
    const size_t at = text.find(key);
    if (at == text.npos || (at > 0 && text[at - 1] != '\n')) return "";
    const std::string_view rest = text.substr(at + key.size());
    return std::string(trim(rest.substr(0, rest.find_first_of(std::string_view("\n\0", 2)))));
  }

  static std::optional<StoredType> type_of(const Page& page) {
    const bool whole = page.format == 1 || page.format == 4, negative = page.format == 2;
    if (page.format == 3)
      return page.bits == 32   ? std::optional(StoredType::kF32)
             : page.bits == 64 ? std::optional(StoredType::kF64)
                               : std::nullopt;
    if (!whole && !negative) return std::nullopt;
    if (page.bits == 8) return negative ? StoredType::kI8 : StoredType::kU8;
    if (page.bits == 16) return negative ? StoredType::kI16 : StoredType::kU16;
    if (page.bits == 32) return negative ? StoredType::kI32 : StoredType::kU32;
    return std::nullopt;
  }

  std::string_view content_;
  bool big_endian_ = false, large_ = false;
  uint64_t entries_ = 0;
  int64_t listed_ = 0;  // images with one directory, according to ImageJ
  uint64_t listed_at_ = 0;
  TiffPages out_;
};

}  // namespace

bool is_stack(std::string_view content) {
  const auto pages = is_tiff(content) ? tiff_pages(content) : std::nullopt;
  return pages && pages->pages > 1 && !pages->placed;
}

bool is_slice_picture(std::string_view start) { return is_tiff(start) || start.starts_with(kPng); }

Result<VolumeFileHeader> stack_header(const std::vector<std::string>& files) {
  return or_error([&] { return header_of(files); });
}

std::optional<TiffPages> tiff_pages(std::string_view content) { return Walker(content).walk(); }

}  // namespace telesplat::data
