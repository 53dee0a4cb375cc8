// Reads two things of a mesh file beside its mesh: the names of other files that it needs, and the array that it marks.
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <pugixml.hpp>

#include "services/data/base/mapped_file.h"
#include "services/data/base/text_scanner.h"
#include "services/data/cloud/readers.h"
#include "services/data/gltf/container.h"
#include "services/data/mesh/formats/obj_materials.h"
#include "services/data/mesh/formats/ply.h"
#include "services/data/mesh/reader.h"
#include "services/data/vtk/reader.h"

namespace telesplat::data {
namespace {

constexpr size_t kMaxCompanions = 1024;

// Returns the names of files that may position a raster: world files, reference systems, headers, GDAL's notes.
std::vector<std::string> raster_sides(const std::string& path) {
  const std::filesystem::path name = std::filesystem::path(path).filename();
  const std::string extension = name.extension().string(), stem = name.stem().string();
  std::vector<std::string> names{name.string() + ".aux.xml"};
  for (const char* other : {".aux.xml", ".wld", ".prj", ".hdr", ".clr"}) names.push_back(stem + other);
  // .pgw for .png, .tfw for .tif, and the whole extension with a w.
  if (extension.size() > 3) names.push_back(stem + extension.substr(0, 2) + extension.back() + "w");
  if (extension.size() > 1) names.push_back(stem + extension + "w");
  return names;
}

// Collects the files that a VRT consists of.
void take_sources(const pugi::xml_node& node, std::vector<std::string>& names) {
  for (const pugi::xml_node& child : node.children()) {
    const std::string_view name = child.name();
    if (names.size() < kMaxCompanions && (name == "SourceFilename" || name == "SourceDataset"))
      names.emplace_back(child.child_value());
    take_sources(child, names);
  }
}

constexpr size_t kMostName = 200;
constexpr size_t kNoMark = std::string_view::npos;

// True for names that readers take for the mesh's colours.
bool names_colours(std::string_view text) {
  const std::string name = lower(text);
  for (const char* colours : {"rgb", "rgba", "color", "colors", "colours", "color_0"})
    if (name == colours) return true;
  return false;
}

// Finds "SCALARS NAME TYPE" below "POINT_DATA N" or "CELL_DATA N"; the first one is active.
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

std::vector<std::string> vrt_sources(std::string_view content) {
  std::vector<std::string> names;
  pugi::xml_document document;
  if (content.substr(0, 1000).find("<VRTDataset") != content.npos &&
      document.load_buffer(content.data(), content.size()))
    take_sources(document, names);
  return names;
}

std::vector<std::string> companion_files(std::string_view content, const std::string& format, const std::string& path) {
  std::vector<std::string> names;
  if (format == "obj") {
    FolderCompanions folder(path);
    std::vector<std::string> missing;
    names = obj_material_libraries(content, folder);
    for (const auto& [name, material] : read_obj_materials(std::vector(names), folder, missing))
      if (!material.texture.empty() && std::find(names.begin(), names.end(), material.texture) == names.end() &&
          names.size() < kMaxCompanions)
        names.push_back(material.texture);
  }
  if (format == "ply")
    if (auto header = or_error([&] { return parse_ply_header(content, path); })) names = std::move(header->textures);
  if (format == "ept") names = ept_files(content, path);
  if (format == "gltf") names = gltf_files(content);
  if (vtk::is_mesh_kind(format)) {
    FolderCompanions companions(path);
    names = vtk::named_files(content, path, companions);
  }
  if (format == "raster") {
    names = vrt_sources(content);
    for (std::string& side : raster_sides(path)) names.push_back(std::move(side));
  }
  for (std::string& name : names) name = (std::filesystem::path(path).parent_path() / name).string();
  return names;
}

std::string active_array(std::string_view text) {
  const std::string name = text.starts_with("# vtk DataFile") ? active_of_legacy(text) : vtk::active_scalars(text);
  return names_colours(name) || name.size() > kMostName ? std::string() : name;
}

std::string active_array_of(const std::string& path) {
  const auto file = MappedFile::open(path);
  if (!file) return {};
  const auto text = (*file)->text();
  return vtk::is_mesh_kind(detect_format(text, path).format) ? active_array(text) : std::string();
}

}  // namespace telesplat::data
