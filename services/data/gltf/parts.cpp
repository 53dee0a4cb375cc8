#include "services/data/gltf/parts.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "services/data/gltf/packed.h"

namespace telesplat::data::gltf {
namespace {

constexpr size_t kMaxPictures = 1024;
constexpr size_t kClampToEdge = 33071, kMirroredRepeat = 33648, kNearest = 9728;

Wrap wrap_of(const Json& sampler, const char* key) {
  const auto word = index(sampler, key);
  return word == kClampToEdge ? Wrap::kClamp : word == kMirroredRepeat ? Wrap::kMirror : Wrap::kRepeat;
}

// The picture's y axis points down: rotation is counterclockwise as seen on the picture.
glm::dmat3x2 uv_transform(const Json& transform) {
  const auto offset = numbers<2>(transform, "offset", {0, 0}), scale = numbers<2>(transform, "scale", {1, 1});
  const double angle = number(transform, "rotation", 0), c = std::cos(angle), s = std::sin(angle);
  return {c * scale[0], -s * scale[0], s * scale[1], c * scale[1], offset[0], offset[1]};
}

constexpr size_t kTriangles = 4, kStrip = 5, kFan = 6;

size_t mode_of(const Json& primitive) { return index(primitive, "mode").value_or(kTriangles); }

// Reads the attributes of a primitive, packed or not.
class Attributes {
 public:
  Attributes(Document& document, const Json& primitive)
      : document_(document),
        accessors_(member(primitive, "attributes")),
        packed_(extension(primitive, "KHR_draco_mesh_compression")) {
    if (!packed_.is_object()) return;
    std::vector<uint32_t> ids;
    for (const Json& id : member(packed_, "attributes"))
      if (id.is_number_unsigned()) ids.push_back(id.get<uint32_t>());
    try {
      draco_ = decode_draco(document.view(index(packed_, "bufferView").value_or(~size_t{0})), ids);
    } catch (const Refusal& refusal) {
      refuse("its KHR_draco_mesh_compression is damaged: {}", refusal.text);
    }
  }

  /// Empty: no such attribute, or one of another width. width: 0 accepts any.
  Values operator()(const std::string& name, int width) {
    const auto accessor = index(accessors_, name.c_str());
    if (!accessor) return {};
    const auto id = index(member(packed_, "attributes"), name.c_str());
    if (!id) return document_.values(*accessor, width);
    Values out = std::move(draco_.attributes[uint32_t(*id)]);
    if (width && out.width != width) refuse("attribute {} has {} components", name, out.width);
    const Json& json = document_.at("accessors", *accessor);
    if (member(json, "normalized") == true) {
      const auto scale = float(normalising_scale(index(json, "componentType").value_or(0)));
      for (float& v : *out.numbers) v = std::max(v * scale, -1.0f);
    }
    return out;
  }

  std::vector<uint32_t> indices(const Json& primitive, size_t vertices) {
    if (packed_.is_object()) return std::move(draco_.indices);
    if (const auto accessor = index(primitive, "indices")) return document_.indices(*accessor);
    std::vector<uint32_t> out(vertices);
    std::iota(out.begin(), out.end(), 0);
    return out;
  }

 private:
  Document& document_;
  const Json& accessors_;
  const Json& packed_;
  DracoMesh draco_;
};

// Strips turn every other triangle; triangles with two equal corners only join strips and are left out.
std::vector<uint32_t> triangles_of(std::vector<uint32_t> list, size_t mode) {
  if (mode == kTriangles) {
    list.resize(list.size() / 3 * 3);
    return list;
  }
  std::vector<uint32_t> out;
  for (size_t i = 2; i < list.size(); ++i) {
    const bool odd = mode == kStrip && i % 2 == 1;
    const uint32_t a = mode == kStrip ? list[i - 2] : list[0], b = list[odd ? i : i - 1], c = list[odd ? i - 1 : i];
    if (a != b && b != c && c != a) out.insert(out.end(), {a, b, c});
  }
  return out;
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
  // A material that is black except for its own light is shown in the colour of that light.
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

bool is_thin(const Json& primitive) { return mode_of(primitive) < kTriangles; }

Primitive read_primitive(Document& document, const Json& json, std::optional<size_t> uv_set, bool deformed) {
  if (mode_of(json) > kFan) refuse("mode {} is not one of glTF's", mode_of(json));
  Attributes read(document, json);
  Primitive out;
  out.positions = read("POSITION", 3);
  const size_t vertices = out.positions.count();
  const auto one_each = [vertices](Values values) { return values.count() == vertices ? std::move(values) : Values{}; };
  out.normals = one_each(read("NORMAL", 3));
  out.colours = one_each(read("COLOR_0", 0));
  if (out.colours.width && out.colours.width < 3) refuse("its colours have {} components", out.colours.width);
  // Colours are always normalised, though some programs forget to say so.
  const Json& colours = document.at("accessors", index(member(json, "attributes"), "COLOR_0").value_or(~size_t{0}));
  if (out.colours.width && member(colours, "normalized") != true)
    out.colour_scale = normalising_scale(index(colours, "componentType").value_or(0));
  if (uv_set) out.uv = one_each(read(fmt::format("TEXCOORD_{}", *uv_set), 2));
  for (int set = 0; deformed; ++set) {
    auto joints = one_each(read(fmt::format("JOINTS_{}", set), 4));
    auto weights = one_each(read(fmt::format("WEIGHTS_{}", set), 4));
    if (joints.count() == 0 || weights.count() == 0) break;
    out.joints.emplace_back(std::move(joints), std::move(weights));
  }
  if (deformed)
    for (const Json& target : member(json, "targets")) {
      const auto moves = [&](const char* key) {
        const auto accessor = index(target, key);
        return accessor ? one_each(document.values(*accessor, 3)) : Values{};
      };
      out.targets.emplace_back(moves("POSITION"), moves("NORMAL"));
    }
  auto list = read.indices(json, vertices);
  for (const uint32_t i : list)
    if (i >= vertices) refuse("names vertex {}, there are {}", i, vertices);
  out.corners = triangles_of(std::move(list), mode_of(json));
  return out;
}

}  // namespace telesplat::data::gltf
