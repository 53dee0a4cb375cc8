#include "services/data/gltf/materials.h"

#include <cmath>

namespace telesplat::data::gltf {
namespace {

constexpr size_t kMaxPictures = 1024;
constexpr size_t kClampToEdge = 33071, kMirroredRepeat = 33648, kNearest = 9728;

Wrap wrap_of(const Json& sampler, const char* key) {
  const auto word = index(sampler, key);
  return word == kClampToEdge ? Wrap::kClamp : word == kMirroredRepeat ? Wrap::kMirror : Wrap::kRepeat;
}

// Its y axis points down: turned against the clock as one sees the picture.
glm::dmat3x2 uv_transform(const Json& transform) {
  const auto offset = numbers<2>(transform, "offset", {0, 0}), scale = numbers<2>(transform, "scale", {1, 1});
  const double angle = number(transform, "rotation", 0), c = std::cos(angle), s = std::sin(angle);
  return {c * scale[0], -s * scale[0], s * scale[1], c * scale[1], offset[0], offset[1]};
}

}  // namespace

const Material& Materials::at(std::optional<size_t> number_of) {
  const auto [at, added] = materials_.try_emplace(number_of.value_or(~size_t{0}));
  Material& out = at->second;
  if (!added || !number_of) return out;
  const Json& json = document_.at("materials", *number_of);
  if (!json.is_object()) refuse("names material {}, there are {}", *number_of, document_.list("materials").size());
  const Json& metal = member(json, "pbrMetallicRoughness");
  const Json& gloss = extension(json, "KHR_materials_pbrSpecularGlossiness");
  const bool own = !gloss.is_object() || metal.contains("baseColorFactor") || metal.contains("baseColorTexture");
  const auto factor = numbers<4>(own ? metal : gloss, own ? "baseColorFactor" : "diffuseFactor", {1, 1, 1, 1});
  out.factor = {factor[0], factor[1], factor[2], factor[3]};
  out.cut = text(json, "alphaMode") == "MASK";
  out.blend = text(json, "alphaMode") == "BLEND";
  out.cutoff = number(json, "alphaCutoff", 0.5);
  const Json* info = &member(own ? metal : gloss, own ? "baseColorTexture" : "diffuseTexture");
  // What is black but for its own light is shown in the colour of that.
  const auto light = numbers<3>(json, "emissiveFactor", {0, 0, 0});
  if (glm::dvec3(out.factor) == glm::dvec3(0) && light != std::array<double, 3>{0, 0, 0}) {
    out.factor = {light[0], light[1], light[2], factor[3]};
    info = &member(json, "emissiveTexture");
  }
  if (const auto texture = index(*info, "index")) {
    out.texture = load(*texture);
    const Json& transform = extension(*info, "KHR_texture_transform");
    out.uv = uv_transform(transform);
    out.uv_set = index(transform, "texCoord").value_or(index(*info, "texCoord").value_or(0));
  }
  return out;
}

uint32_t Materials::load(size_t number_of) {
  const auto [at, added] = loaded_.try_emplace(number_of, kNoTexture);
  if (!added || textures.size() >= kMaxPictures) return at->second;
  const Json& texture = document_.at("textures", number_of);
  auto source = index(extension(texture, "EXT_texture_webp"), "source");
  if (!source) source = index(texture, "source");
  if (!source) {
    const Json& instead = member(texture, "extensions");
    if (instead.is_object() && !instead.empty())
      notes.push_back(fmt::format("{}: texture {} is in a format that is not read ({}); its material's colour is shown",
                                  name_, number_of, instead.begin().key()));
    return kNoTexture;
  }
  const Json& image = document_.at("images", *source);
  const std::string uri = text(image, "uri");
  const bool beside = !uri.empty() && !uri.starts_with("data:");
  const std::string told = beside ? uri : fmt::format("image {}", *source);
  std::string_view bytes;
  if (const auto view = index(image, "bufferView")) {
    const Bytes data = document_.view(*view);
    bytes = {reinterpret_cast<const char*>(data.data()), data.size()};
  } else if (const auto data = document_.resource(uri); data && !uri.empty()) {
    bytes = *data;
  } else if (beside || uri.empty()) {
    notes.push_back(fmt::format("{}: the texture {} is not there; its material's colour is shown", name_, told));
    return kNoTexture;
  } else {
    refuse("{} {}", told, data.error().text);
  }
  auto picture = image::read_picture(std::as_bytes(std::span(bytes)), told, room_);
  if (!picture) refuse("{}", picture.error().text);
  room_ -= picture->colour.size();
  const Json& sampler = document_.at("samplers", index(texture, "sampler").value_or(~size_t{0}));
  textures.push_back(std::make_shared<Texture>(std::move(*picture), wrap_of(sampler, "wrapS"),
                                               wrap_of(sampler, "wrapT"), index(sampler, "magFilter") == kNearest));
  return at->second = uint32_t(textures.size() - 1);
}

}  // namespace telesplat::data::gltf
