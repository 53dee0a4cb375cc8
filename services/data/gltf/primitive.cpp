#include "services/data/gltf/primitive.h"

#include <algorithm>
#include <numeric>

#include "services/data/gltf/draco.h"

namespace telesplat::data::gltf {
namespace {

constexpr size_t kTriangles = 4, kStrip = 5, kFan = 6;

size_t mode_of(const Json& primitive) { return index(primitive, "mode").value_or(kTriangles); }

// What attributes of a primitive hold, wherever they lie.
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

  /// Empty: there is no such attribute, or one of another width. width: 0 takes any.
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

// Strips turn every other triangle; those that have one corner twice join strips and are none.
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
