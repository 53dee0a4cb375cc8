#include "services/data/gltf/container.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <nlohmann/json.hpp>

namespace telesplat::data {
namespace {

constexpr size_t kGlbHeader = 12, kChunkHeader = 8, kMaxUris = 1024;

uint32_t word_at(std::string_view content, size_t offset) {
  uint32_t word;
  std::memcpy(&word, content.data() + offset, 4);
  return word;
}

}  // namespace

bool looks_like_gltf(std::string_view content) {
  if (content.starts_with("glTF")) return true;
  if (content.starts_with("\xef\xbb\xbf")) content.remove_prefix(3);
  const size_t first = content.find_first_not_of(" \t\r\n");
  return first != content.npos && content[first] == '{' && content.find("\"asset\"") != content.npos;
}

std::string_view gltf_json(std::string_view content) {
  if (!content.starts_with("glTF")) return content;
  if (content.size() < kGlbHeader + kChunkHeader) return {};
  const uint32_t bytes = word_at(content, kGlbHeader);
  if (bytes > content.size() - kGlbHeader - kChunkHeader) return {};
  return content.substr(kGlbHeader + kChunkHeader, bytes);
}

std::string_view glb_binary(std::string_view content) {
  const std::string_view json = gltf_json(content);
  if (!content.starts_with("glTF") || json.empty()) return {};
  const size_t at = (kGlbHeader + kChunkHeader + json.size() + 3) / 4 * 4;
  if (content.size() < at + kChunkHeader) return {};
  return content.substr(at + kChunkHeader, word_at(content, at));
}

bool gltf_json_fits(std::string_view content) {
  const std::string_view json = gltf_json(content);
  if (json.size() <= kMostGltfJson) return true;
  uint64_t outside = 0;
  for (size_t at = 0; at < json.size() && outside <= kMostGltfJson;) {
    const size_t quote = std::min(json.find('"', at), json.size());
    outside += quote - at + 2;
    for (at = quote + 1; at < json.size() && json[at] != '"'; ++at)
      if (json[at] == '\\') ++at;
    ++at;
  }
  return outside <= kMostGltfJson;
}

std::vector<std::string> gltf_files(std::string_view content) {
  std::vector<std::string> out;
  if (!gltf_json_fits(content)) return out;  // read_gltf() refuses it
  const nlohmann::json document = nlohmann::json::parse(gltf_json(content), nullptr, false);
  if (!document.is_object()) return out;
  for (const char* kind : {"buffers", "images"}) {
    const auto list = document.find(kind);
    if (list == document.end() || !list->is_array()) continue;
    for (const auto& item : *list) {
      const auto uri = item.is_object() ? item.find("uri") : item.end();
      if (!item.is_object() || uri == item.end() || !uri->is_string() || out.size() >= kMaxUris) continue;
      const auto& text = uri->get_ref<const std::string&>();
      if (text.starts_with("data:")) continue;
      out.push_back(uri_file(text));
      if (out.back() != text) out.push_back(text);
    }
  }
  return out;
}

std::string uri_file(const std::string& uri) {
  std::string out;
  for (size_t i = 0; i < uri.size(); ++i) {
    unsigned byte = 0;
    const char* end = uri.data() + std::min(i + 3, uri.size());
    if (uri[i] == '%' && std::from_chars(uri.data() + i + 1, end, byte, 16).ptr == uri.data() + i + 3 && byte)
      out += char(byte), i += 2;
    else
      out += uri[i] == '\\' ? '/' : uri[i];
  }
  return out;
}

}  // namespace telesplat::data
