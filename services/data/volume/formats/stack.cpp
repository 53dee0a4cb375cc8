#include "services/data/volume/formats/stack.h"

#include <fmt/format.h>

#include "services/data/base/mapped_file.h"
#include "services/data/volume/formats/header_text.h"
#include "services/data/volume/formats/tiff_pages.h"

namespace telesplat::data {
namespace {

constexpr std::string_view kPng("\x89PNG\r\n\x1a\n", 8);

bool is_tiff(std::string_view start) {
  using namespace std::string_view_literals;
  return start.starts_with("II*\0"sv) || start.starts_with("MM\0*"sv) || start.starts_with("II+\0"sv) ||
         start.starts_with("MM\0+"sv);
}

// One page, from a PNG's first chunk. Source: W3C, "Portable Network Graphics", 11.2.2.
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

Result<TiffPages> pages_of(const std::string& path) {
  const auto file = MappedFile::open(path);
  if (!file) return file.error();
  const std::string_view content = (*file)->text();
  const auto pages = content.starts_with(kPng) ? std::optional(pages_of_png(content)) : tiff_pages(content);
  if (!pages) return Error{fmt::format("{}: is a damaged TIFF file, or is none", path)};
  if (pages->channels != 1)
    return Error{
        fmt::format("{}: has {} channels a pixel; slices of a volume have one, of grey", path, pages->channels)};
  if (!pages->type)
    return Error{fmt::format("{}: its pixels are of a type that is not read; {}", path, kSupportedTypes)};
  return *pages;
}

}  // namespace

bool is_stack(std::string_view content) {
  const auto pages = is_tiff(content) ? tiff_pages(content) : std::nullopt;
  return pages && pages->pages > 1 && !pages->placed;
}

bool is_slice_picture(std::string_view start) { return is_tiff(start) || start.starts_with(kPng); }

Result<VolumeFileHeader> stack_header(const std::vector<std::string>& files) {
  VolumeFileHeader h;
  h.format = "stack";
  for (const std::string& path : files) {
    const auto pages = pages_of(path);
    if (!pages) return pages.error();
    if (path == files[0]) {
      h.size = {pages->width, pages->height, 0};
      h.stored = *pages->type;
      h.big_endian = pages->big_endian;
      h.unit = pages->unit.substr(0, scene::kMaxUnit);
      const glm::dvec3& s = pages->spacing;
      h.index_to_data = placement({s.x, 0, 0}, {0, s.y, 0}, {0, 0, s.z}, glm::dvec3(0));
      h.data_path = path, h.data_at = pages->data_at;
    }
    if (pages->width != h.size[0] || pages->height != h.size[1] || *pages->type != h.stored)
      return Error{fmt::format("{}: is a picture of {} x {} of {}, the first slice, {}, has {} x {} of {}", path,
                               pages->width, pages->height, name_of(*pages->type), files[0], h.size[0], h.size[1],
                               name_of(h.stored))};
    h.size[2] += pages->pages;
  }
  return h;
}

}  // namespace telesplat::data
