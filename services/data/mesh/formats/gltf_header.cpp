#include "services/data/mesh/formats/gltf_header.h"

#include <fmt/format.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "services/data/texture/gltf_textures.h"

namespace telesplat::data {
namespace {

constexpr size_t kGlbHeader = 12, kChunkHeader = 8;

uint32_t word_at(std::string_view content, size_t offset) {
  uint32_t word;
  std::memcpy(&word, content.data() + offset, 4);
  return word;
}

}  // namespace

Status check_gltf(std::string_view content, uint64_t data_bytes, const std::string& name) {
  if (content.starts_with("glTF")) {
    if (content.size() < kGlbHeader + kChunkHeader)
      return Error{fmt::format("{}: {} bytes are too few for a GLB file", name, content.size())};
    if (word_at(content, 4) != 2)
      return Error{fmt::format("{}: is glTF version {}, only 2 is read", name, word_at(content, 4))};
    if (word_at(content, 8) > content.size())
      return Error{fmt::format("{}: is truncated: its header claims {} bytes, it has {}", name, word_at(content, 8),
                               content.size())};
    if (gltf_json(content).empty())
      return Error{fmt::format("{}: its JSON chunk claims {} bytes, the file has {}", name,
                               word_at(content, kGlbHeader), content.size())};
  }
  if (!gltf_json_fits(content))
    return Error{fmt::format("{}: its glTF JSON has more than {} bytes outside of texts", name, kMostGltfJson)};
  const nlohmann::json document = nlohmann::json::parse(gltf_json(content), nullptr, false);
  if (!document.is_object()) return Error{name + ": its glTF JSON is damaged"};
  const auto accessors = document.find("accessors");
  if (accessors == document.end() || !accessors->is_array()) return ok_status();
  for (size_t i = 0; i < accessors->size(); ++i) {
    const auto& accessor = (*accessors)[i];
    const auto count = accessor.is_object() ? accessor.find("count") : accessor.end();
    if (!accessor.is_object() || count == accessor.end() || !count->is_number() || count->get<double>() < 0)
      return Error{fmt::format("{}: accessor {} has no count", name, i)};
    if (count->get<double>() > static_cast<double>(data_bytes))
      return Error{fmt::format("{}: accessor {} claims {} elements, its files have {} bytes", name, i, count->dump(),
                               data_bytes)};
  }
  return ok_status();
}

}  // namespace telesplat::data
