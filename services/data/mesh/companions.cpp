// Which other files a mesh file pulls in: material libraries of an OBJ and their textures, buffers and images of a
// glTF.
#include <algorithm>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "services/data/mesh/formats/obj_materials.h"
#include "services/data/mesh/reader.h"
#include "services/data/texture/gltf_textures.h"

namespace telesplat::data {
namespace {

constexpr size_t kMaxCompanions = 1024;

// The uris of buffers and images, as VTK looks for them: without undoing %20 and its like.
std::vector<std::string> gltf_uris(std::string_view content) {
  std::vector<std::string> names;
  if (!gltf_json_fits(content)) return names;  // check_gltf() refuses it
  const nlohmann::json document = nlohmann::json::parse(gltf_json(content), nullptr, false);
  if (!document.is_object()) return names;
  for (const char* kind : {"buffers", "images"}) {
    const auto list = document.find(kind);
    if (list == document.end() || !list->is_array()) continue;
    for (const auto& item : *list) {
      const auto uri = item.is_object() ? item.find("uri") : item.end();
      if (!item.is_object() || uri == item.end() || !uri->is_string() || names.size() == kMaxCompanions) continue;
      if (const auto& text = uri->get_ref<const std::string&>(); !text.starts_with("data:")) names.push_back(text);
    }
  }
  return names;
}

}  // namespace

std::vector<std::string> companion_files(std::string_view content, const std::string& format, const std::string& path) {
  std::vector<std::string> names;
  if (format == "obj") {
    std::vector<std::string> files = obj_material_libraries(content, path);
    const auto materials = read_obj_materials(files);
    for (const auto& [name, material] : materials)
      if (!material.texture.empty() && std::find(files.begin(), files.end(), material.texture) == files.end() &&
          files.size() < kMaxCompanions)
        files.push_back(material.texture);
    return files;
  }
  if (format == "gltf") names = gltf_uris(content);
  for (std::string& name : names) name = (std::filesystem::path(path).parent_path() / name).string();
  return names;
}

}  // namespace telesplat::data
