#include "services/data/mesh/active_array.h"

#include <algorithm>
#include <cctype>

#include "services/data/base/mapped_file.h"
#include "services/data/mesh/reader.h"
#include "services/data/vtk/reader.h"

namespace telesplat::data {
namespace {

constexpr size_t kMostName = 200;
constexpr size_t kNoMark = std::string_view::npos;

// What the readers take for colours of the mesh.
bool names_colours(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  for (const char* colours : {"rgb", "rgba", "color", "colors", "colours", "color_0"})
    if (name == colours) return true;
  return false;
}

// "SCALARS NAME TYPE" below "POINT_DATA N" or "CELL_DATA N"; the first one is active.
std::string active_of_legacy(std::string_view text) {
  for (const char* part : {"\nPOINT_DATA ", "\nCELL_DATA "}) {
    const size_t from = text.find(part);
    if (from == kNoMark) continue;
    const std::string_view other = part[1] == 'P' ? "\nCELL_DATA " : "\nPOINT_DATA ";
    const size_t at = text.find("\nSCALARS ", from);
    if (at == kNoMark || at > text.find(other, from)) continue;
    const size_t begin = at + 9, end = text.find_first_of(" \n\r", begin);
    if (end != kNoMark && end - begin <= kMostName) return std::string(text.substr(begin, end - begin));
  }
  return {};
}

}  // namespace

std::string active_array(std::string_view text) {
  const std::string name = text.starts_with("# vtk DataFile") ? active_of_legacy(text) : vtk::active_scalars(text);
  return names_colours(name) || name.size() > kMostName ? std::string() : name;
}

std::string active_array_of(const std::string& path) {
  const auto file = MappedFile::open(path);
  if (!file) return {};
  const auto text = (*file)->text();
  return has_arrays(detect_format(text, path).format) ? active_array(text) : std::string();
}

}  // namespace telesplat::data
