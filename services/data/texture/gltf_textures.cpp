#include "services/data/texture/gltf_textures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "services/data/base/mapped_file.h"

namespace telesplat::data {
namespace {

using Json = nlohmann::json;

constexpr size_t kGlbHeader = 12, kChunkHeader = 8;
constexpr size_t kMaxPictures = 1024;
constexpr int kClampToEdge = 33071, kMirroredRepeat = 33648, kNearest = 9728;

uint32_t word_at(std::string_view content, size_t offset) {
  uint32_t word;
  std::memcpy(&word, content.data() + offset, 4);
  return word;
}

// Its second chunk; empty if it has none.
std::string_view glb_binary(std::string_view content) {
  const std::string_view json = gltf_json(content);
  if (!content.starts_with("glTF") || json.empty()) return {};
  const size_t at = (kGlbHeader + kChunkHeader + json.size() + 3) / 4 * 4;
  if (content.size() < at + kChunkHeader) return {};
  return content.substr(at + kChunkHeader, word_at(content, at));
}

Json parse(std::string_view content) {
  return gltf_json_fits(content) ? Json::parse(gltf_json(content), nullptr, false) : Json(Json::value_t::discarded);
}

const Json& member(const Json& of, const char* key) {
  static const Json kNothing;
  const auto found = of.is_object() ? of.find(key) : of.end();
  return of.is_object() && found != of.end() ? *found : kNothing;
}
const Json& element(const Json& of, const char* key, size_t i) {
  static const Json kNothing;
  const Json& list = member(of, key);
  return list.is_array() && i < list.size() ? list[i] : kNothing;
}
std::optional<size_t> index(const Json& of, const char* key) {
  const Json& value = member(of, key);
  return value.is_number_unsigned() ? std::optional(value.get<size_t>()) : std::nullopt;
}
std::string text(const Json& of, const char* key) {
  const Json& value = member(of, key);
  return value.is_string() ? value.get<std::string>() : std::string();
}

// What stands for itself in a data URI; nothing if it is no base64.
std::optional<std::string> from_base64(std::string_view text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    const size_t digit = kDigits.find(c);
    if (digit == kDigits.npos) return std::nullopt;
    bits = bits << 6 | uint32_t(digit);
    if ((count += 6) >= 8) out += char(bits >> (count -= 8) & 255);
  }
  return out;
}

std::string beside(const std::string& path, const std::string& name) {
  return (std::filesystem::path(path).parent_path() / name).string();
}

// The bytes of a picture and what holds them.
struct Picture {
  std::string name;  // for error texts
  std::string own;
  std::shared_ptr<const MappedFile> file;
  std::string_view bytes;
  bool missing = false;
};

Result<Picture> from_view(const Json& document, std::string_view content, size_t view, Picture picture,
                          const std::string& path) {
  const Json& v = element(document, "bufferViews", view);
  const auto buffer = index(v, "buffer");
  const size_t offset = index(v, "byteOffset").value_or(0), length = index(v, "byteLength").value_or(0);
  std::string_view data;
  const std::string uri = buffer ? text(element(document, "buffers", *buffer), "uri") : "";
  if (buffer == 0u && uri.empty()) {
    data = glb_binary(content);
  } else if (uri.starts_with("data:")) {
    const auto decoded = from_base64(std::string_view(uri).substr(std::min(uri.find(',') + 1, uri.size())));
    picture.own = decoded.value_or("");
    data = picture.own;
  } else if (!uri.empty()) {
    const auto file = MappedFile::open(beside(path, uri));
    if (!file) return file.error();
    picture.file = *file;
    data = picture.file->text();
  }
  if (length == 0 || offset > data.size() || length > data.size() - offset)
    return Error{fmt::format("{} claims {} bytes from {} on, there are {}", picture.name, length, offset, data.size())};
  if (picture.file || picture.own.empty())
    picture.bytes = data.substr(offset, length);
  else
    picture.own = picture.own.substr(offset, length);
  return picture;
}

Result<Picture> find_picture(const Json& document, std::string_view content, size_t i, const std::string& path) {
  const Json& image = element(document, "images", i);
  Picture picture;
  picture.name = fmt::format("{}: image {}", path, i);
  const std::string uri = text(image, "uri");
  if (const auto view = index(image, "bufferView")) return from_view(document, content, *view, picture, path);
  if (uri.starts_with("data:")) {
    auto decoded = from_base64(std::string_view(uri).substr(std::min(uri.find(',') + 1, uri.size())));
    if (!decoded || decoded->empty()) return Error{picture.name + " is no base64 text"};
    picture.own = std::move(*decoded);
    return picture;  // bytes are taken from `own`, which moves along
  }
  picture.name = uri.empty() ? picture.name : beside(path, uri);
  const auto file = uri.empty() ? Result<std::shared_ptr<const MappedFile>>(Error{}) : MappedFile::open(picture.name);
  picture.missing = !file;
  if (file) picture.file = *file, picture.bytes = picture.file->text();
  return picture;
}

Wrap wrap_of(const Json& sampler, const char* key) {
  const auto word = index(sampler, key).value_or(0);
  return word == kClampToEdge ? Wrap::kClamp : word == kMirroredRepeat ? Wrap::kMirror : Wrap::kRepeat;
}

// Numbers of the textures that are base colours.
std::vector<size_t> base_colours(const Json& document) {
  std::vector<size_t> out;
  const Json& materials = member(document, "materials");
  for (size_t m = 0; materials.is_array() && m < materials.size(); ++m) {
    const auto texture = index(member(member(materials[m], "pbrMetallicRoughness"), "baseColorTexture"), "index");
    if (texture && *texture < kMaxPictures && std::find(out.begin(), out.end(), *texture) == out.end())
      out.push_back(*texture);
  }
  return out;
}

}  // namespace

std::string_view gltf_json(std::string_view content) {
  if (!content.starts_with("glTF")) return content;
  if (content.size() < kGlbHeader + kChunkHeader) return {};
  const uint32_t bytes = word_at(content, kGlbHeader);
  if (bytes > content.size() - kGlbHeader - kChunkHeader) return {};
  return content.substr(kGlbHeader + kChunkHeader, bytes);
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

std::vector<std::string> gltf_picture_files(std::string_view content, const std::string& path) {
  std::vector<std::string> out;
  const Json document = parse(content);
  const Json& images = member(document, "images");
  for (size_t i = 0; images.is_array() && i < std::min(images.size(), kMaxPictures); ++i)
    if (const std::string uri = text(images[i], "uri"); !uri.empty() && !uri.starts_with("data:"))
      out.push_back(beside(path, uri));
  return out;
}

Result<GltfTextures> read_gltf_textures(std::string_view content, const std::string& path) {
  GltfTextures out;
  const Json document = parse(content);
  uint64_t room = kMaxTexels;
  for (const size_t t : base_colours(document)) {
    const Json& texture = element(document, "textures", t);
    const auto source = index(texture, "source");
    if (!source) continue;
    const auto picture = find_picture(document, content, *source, path);
    if (!picture) return picture.error();
    if (picture->missing) {
      out.notes.push_back(
          fmt::format("{}: the texture {} is not there; its material's colour is shown", path, picture->name));
      continue;
    }
    const std::string_view bytes = picture->bytes.empty() ? std::string_view(picture->own) : picture->bytes;
    auto view =
        image::read_picture({reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()}, picture->name, room);
    if (!view) return view.error();
    room -= view->colour.size();
    const Json& sampler = element(document, "samplers", index(texture, "sampler").value_or(~size_t{0}));
    out.all.resize(std::max(out.all.size(), t + 1));
    out.all[t] = std::make_shared<Texture>(std::move(*view), wrap_of(sampler, "wrapS"), wrap_of(sampler, "wrapT"),
                                           index(sampler, "magFilter") == size_t(kNearest));
  }
  return out;
}

}  // namespace telesplat::data
