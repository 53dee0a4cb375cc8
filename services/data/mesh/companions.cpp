// Which other files a mesh file pulls in.
#include <algorithm>
#include <filesystem>
#include <pugixml.hpp>

#include "services/data/gltf/container.h"
#include "services/data/mesh/formats/obj_materials.h"
#include "services/data/mesh/formats/ply_header.h"
#include "services/data/mesh/reader.h"
#include "services/data/vtk/reader.h"

namespace telesplat::data {
namespace {

constexpr size_t kMaxCompanions = 1024;

// What may say beside a raster where it lies: world files, reference systems, headers, GDAL's notes.
std::vector<std::string> raster_sides(const std::string& path) {
  const std::filesystem::path name = std::filesystem::path(path).filename();
  const std::string extension = name.extension().string(), stem = name.stem().string();
  std::vector<std::string> names{name.string() + ".aux.xml"};
  for (const char* other : {".aux.xml", ".wld", ".prj", ".hdr", ".clr"}) names.push_back(stem + other);
  // .pgw of .png, .tfw of .tif, and the whole extension with a w.
  if (extension.size() > 3) names.push_back(stem + extension.substr(0, 2) + extension.back() + "w");
  if (extension.size() > 1) names.push_back(stem + extension + "w");
  return names;
}

// The files that a VRT is made of.
void take_sources(const pugi::xml_node& node, std::vector<std::string>& names) {
  for (const pugi::xml_node& child : node.children()) {
    const std::string_view name = child.name();
    if (names.size() < kMaxCompanions && (name == "SourceFilename" || name == "SourceDataset"))
      names.emplace_back(child.child_value());
    take_sources(child, names);
  }
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
    if (auto header = parse_ply_header(content, path)) names = std::move(header->textures);
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

}  // namespace telesplat::data
