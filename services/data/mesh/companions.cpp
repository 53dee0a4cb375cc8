// Which other files a mesh file pulls in: material libraries of an OBJ, buffers and images of a glTF.
#include <algorithm>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "services/data/mesh/formats/gltf_header.h"
#include "services/data/mesh/reader.h"

namespace telesplat::data {
namespace {

constexpr size_t kMaxCompanions = 64;

// The names after "mtllib" at lines' starts.
std::vector<std::string> material_libraries(std::string_view content) {
  std::vector<std::string> names;
  constexpr std::string_view kWord = "mtllib";
  for (size_t at = content.find(kWord); at != content.npos && names.size() < kMaxCompanions;
       at = content.find(kWord, at)) {
    const bool starts_line = at == 0 || content[at - 1] == '\n';
    at += kWord.size();
    if (!starts_line) continue;
    std::string_view name = content.substr(at, std::min(content.find('\n', at), content.size()) - at);
    while (!name.empty() && static_cast<unsigned char>(name.front()) <= ' ') name.remove_prefix(1);
    while (!name.empty() && static_cast<unsigned char>(name.back()) <= ' ') name.remove_suffix(1);
    if (!name.empty()) names.emplace_back(name);
  }
  return names;
}

// The uris of buffers and images, as VTK looks for them: without undoing %20 and its like.
std::vector<std::string> gltf_uris(std::string_view content) {
  std::vector<std::string> names;
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
  if (format == "obj") names = material_libraries(content);
  if (format == "gltf") names = gltf_uris(content);
  for (std::string& name : names) name = (std::filesystem::path(path).parent_path() / name).string();
  return names;
}

}  // namespace telesplat::data
