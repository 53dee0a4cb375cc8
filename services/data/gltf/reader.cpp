#include "services/data/gltf/reader.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>
#include <unordered_map>

#include "common/image/srgb.h"
#include "services/data/gltf/parts.h"

namespace telesplat::data {
namespace gltf {
namespace {

constexpr size_t kMostVertices = size_t{1} << 25;  // with instances; the files' bytes allow one more per two bytes
constexpr double kInvisible = 1 / 512.0;           // opacity below half of an 8-bit step

// Extensions that files may require: those that are read, and those that change neither shapes nor base colours.
constexpr std::string_view kRead[] = {
    "KHR_mesh_quantization",   "EXT_meshopt_compression", "KHR_meshopt_compression", "KHR_draco_mesh_compression",
    "EXT_mesh_gpu_instancing", "KHR_texture_transform",   "EXT_texture_webp",        "KHR_node_visibility"};
constexpr std::string_view kHarmless[] = {
    "KHR_materials_",    "KHR_lights_", "EXT_lights_",   "KHR_animation_",          "KHR_xmp",
    "EXT_mesh_features", "VRM",         "EXT_instance_", "EXT_structural_metadata", "MSFT_lod",
    "CESIUM_primitive_o"};

void check_extensions(const Document& document) {
  for (const Json& required : document.list("extensionsRequired")) {
    const std::string name = required.is_string() ? required.get<std::string>() : required.dump();
    const auto begins = [&](std::string_view known) { return name.starts_with(known); };
    if (std::find(std::begin(kRead), std::end(kRead), name) == std::end(kRead) &&
        std::none_of(std::begin(kHarmless), std::end(kHarmless), begins))
      refuse("requires the glTF extension {}, which is not read; save the file without it", name);
  }
}

class Reader {
 public:
  Reader(std::string_view content, const std::string& name, Companions& companions)
      : name_(name), document_(content, companions), materials_(document_, name) {
    mesh_.format = "gltf";
  }

  Mesh read(uint64_t texture_detail) {
    check_extensions(document_);
    for (const auto& [number, placements] : place_meshes(document_)) {
      const Json& mesh = document_.at("meshes", number);
      if (!mesh.is_object()) refuse("names mesh {}, there are {}", number, document_.list("meshes").size());
      const Json& primitives = member(mesh, "primitives");
      for (size_t p = 0; p < primitives.size(); ++p) try {
          add(element(primitives, p), morph_weights(mesh), placements);
        } catch (const Refusal& refusal) {
          refuse("primitive {} of mesh {}: {}", p, number, refusal.text);
        }
    }
    if (mesh_.indices.empty() && thin_ + hidden_ > 0)
      refuse("holds no visible triangles, {} parts of points or lines, {} transparent triangles", thin_, hidden_);
    return finish(texture_detail);
  }

 private:
  void add(const Json& json, const std::vector<double>& weights, const std::vector<Placement>& placements) {
    if (is_thin(json)) return void(++thin_);
    const Material& material = materials_.at(index(json, "material"));
    const bool textured = material.texture != kNoTexture;
    const auto uses = [](const Placement& p) { return p.joints || !p.weights.empty(); };
    const bool deformed = !weights.empty() || std::any_of(placements.begin(), placements.end(), uses);
    Primitive primitive =
        read_primitive(document_, json, textured ? std::optional(material.uv_set) : std::nullopt, deformed);
    drop_invisible(material, primitive);
    const auto used = keep_used(primitive);
    if (used.size() * placements.size() > most_vertices_ - mesh_.positions.size())
      refuse("{} vertices in {} places; with the {} before, the limit is {}", used.size(), placements.size(),
             mesh_.positions.size(), most_vertices_);
    translucent_ += material.blend && (textured || opacity_below(1 - kInvisible, material, primitive));
    cut_by_texture_ += material.cut && textured;
    for (const Placement& placement : placements) {
      const auto base = uint32_t(mesh_.positions.size());
      const double turned =
          add_places(primitive, used, placement, placement.weights.empty() ? weights : placement.weights);
      add_colours(primitive, used, material);
      for (size_t i = 0; i < primitive.corners.size(); i += 3) {
        const uint32_t* c = &primitive.corners[i];
        mesh_.indices.insert(mesh_.indices.end(),
                             {base + c[0], base + c[turned < 0 ? 2 : 1], base + c[turned < 0 ? 1 : 2]});
      }
    }
  }

  static double opacity(const Material& material, const Primitive& primitive, uint32_t vertex) {
    return material.factor.a *
           (primitive.colours.width == 4 ? primitive.colour_scale * primitive.colours[vertex][3] : 1.0);
  }
  static bool opacity_below(double limit, const Material& material, const Primitive& primitive) {
    return std::any_of(primitive.corners.begin(), primitive.corners.end(),
                       [&](uint32_t v) { return opacity(material, primitive, v) < limit; });
  }

  // Leaves out triangles that are cut away or fully transparent.
  void drop_invisible(const Material& material, Primitive& primitive) {
    if (!material.cut && !material.blend) return;
    const double limit = material.cut ? material.cutoff : kInvisible;
    auto& corners = primitive.corners;
    size_t kept = 0;
    for (size_t i = 0; i < corners.size(); i += 3) {
      const bool gone = std::all_of(&corners[i], &corners[i] + 3,
                                    [&](uint32_t v) { return opacity(material, primitive, v) < limit; });
      if (gone)
        ++hidden_;
      else
        std::copy_n(&corners[i], 3, &corners[kept]), kept += 3;
    }
    corners.resize(kept);
  }

  // Returns the vertices that the primitive uses, and renumbers its corners by them: many primitives may share one
  // list of vertices and use few of it each.
  static std::vector<uint32_t> keep_used(Primitive& primitive) {
    auto& corners = primitive.corners;
    const size_t vertices = primitive.positions.count();
    std::vector<uint32_t> used;
    if (corners.size() < vertices) {
      used = corners;
      std::sort(used.begin(), used.end());
      used.erase(std::unique(used.begin(), used.end()), used.end());
      for (uint32_t& c : corners) c = uint32_t(std::lower_bound(used.begin(), used.end(), c) - used.begin());
      return used;
    }
    std::vector<uint32_t> number(vertices, 0);
    for (const uint32_t c : corners) number[c] = 1;
    for (uint32_t v = 0; v < vertices; ++v)
      if (number[v]) number[v] = uint32_t(used.size()), used.push_back(v);
    for (uint32_t& c : corners) c = number[c];
    return used;
  }

  // Returns a negative number if the placement mirrors.
  double add_places(const Primitive& primitive, const std::vector<uint32_t>& used, const Placement& placement,
                    const std::vector<double>& weights) {
    const bool skinned = placement.joints && !primitive.joints.empty();
    glm::dmat4 matrix = placement.to_world;
    glm::dmat3 cofactors(1);
    const auto set = [&](const glm::dmat4& to) {
      matrix = to;
      const glm::dvec3 x(to[0]), y(to[1]), z(to[2]);
      cofactors = {glm::cross(y, z), glm::cross(z, x), glm::cross(x, y)};
      return glm::dot(x, cofactors[0]);
    };
    double turned = set(matrix);
    for (size_t i = 0; i < used.size(); ++i) {
      const uint32_t v = used[i];
      if (skinned) {
        const double determinant = set(skin(primitive, v, *placement.joints));
        if (i == 0) turned = determinant;
      }
      glm::dvec3 p = glm::make_vec3(primitive.positions[v]);
      glm::dvec3 n = primitive.normals.width ? glm::make_vec3(primitive.normals[v]) : glm::vec3(0);
      for (size_t t = 0; t < std::min(weights.size(), primitive.targets.size()); ++t) {
        const auto& [moves, turns] = primitive.targets[t];
        if (moves.width) p += weights[t] * glm::dvec3(glm::make_vec3(moves[v]));
        if (turns.width && primitive.normals.width) n += weights[t] * glm::dvec3(glm::make_vec3(turns[v]));
      }
      mesh_.positions.emplace_back(matrix * glm::dvec4(p, 1));
      n = cofactors * n * (turned < 0 ? -1.0 : 1.0);
      const double length = glm::length(n);
      mesh_.normals.emplace_back(length > 0 ? n / length : glm::dvec3(0));
    }
    any_normals_ |= primitive.normals.width > 0;
    return turned;
  }

  static glm::dmat4 skin(const Primitive& primitive, uint32_t vertex, const std::vector<glm::dmat4>& joints) {
    glm::dmat4 out(0);
    double sum = 0;
    for (const auto& [numbers, weights] : primitive.joints)
      for (int k = 0; k < 4; ++k) {
        const double weight = weights[vertex][k];
        if (weight == 0) continue;
        const auto joint = size_t(numbers[vertex][k]);
        if (joint >= joints.size()) refuse("names joint {}, its skin has {}", joint, joints.size());
        out += weight * joints[joint];
        sum += weight;
      }
    return sum > 0 ? out / sum : joints[0];
  }

  void add_colours(const Primitive& primitive, const std::vector<uint32_t>& used, const Material& material) {
    const Values &colours = primitive.colours, &uv = primitive.uv;
    const uint32_t texture = uv.width ? material.texture : kNoTexture;
    const bool coloured = colours.width || texture != kNoTexture || glm::dvec3(material.factor) != glm::dvec3(1);
    any_colours_ |= coloured;
    any_textures_ |= texture != kNoTexture;
    for (const uint32_t v : used) {
      use_.texture.push_back(texture);
      use_.uv.push_back(texture == kNoTexture ? glm::vec2(0)
                                              : glm::vec2(material.uv * glm::dvec3(uv[v][0], uv[v][1], 1)));
      glm::dvec3 c = material.factor;  // linear light, as the colours of glTF's vertices
      if (colours.width) c *= primitive.colour_scale * glm::dvec3(glm::make_vec3(colours[v]));
      const auto code = [](double linear) { return image::srgb_of_linear(float(linear)); };
      mesh_.colours.push_back(coloured ? pack_rgb(code(c.r), code(c.g), code(c.b)) : kNeutralAlbedo);
    }
  }

  Mesh finish(uint64_t texture_detail) {
    const auto note = [this](size_t count, std::string text) {
      if (count > 0) mesh_.notes.push_back(fmt::format("{}: {}", name_, text));
    };
    mesh_.notes = std::move(materials_.notes);
    note(thin_, fmt::format("parts of points or lines are left out: {}", thin_));
    note(hidden_, fmt::format("triangles that are fully transparent are left out: {}", hidden_));
    note(translucent_, fmt::format("translucent parts are shown opaque: {}", translucent_));
    note(cut_by_texture_, fmt::format("parts are shown without the holes of their textures: {}", cut_by_texture_));
    const size_t animations = document_.list("animations").size();
    const size_t scenes = document_.list("scenes").size();
    note(scenes > 1, fmt::format("scenes that are not shown: {}", scenes - 1));
    note(animations, fmt::format("animations are not played: {}", animations));
    if (any_textures_) {
      any_normals_ = true;
      use_.textures = std::move(materials_.textures);
      const std::string left_out = bake_textures(mesh_, std::move(use_), texture_detail);
      note(left_out.size(), left_out);
    }
    if (!any_normals_) mesh_.normals = {};
    if (!any_colours_) mesh_.colours = {};
    return std::move(mesh_);
  }

  const std::string name_;
  Document document_;
  Materials materials_;
  Mesh mesh_;
  TextureUse use_;
  const size_t most_vertices_ = kMostVertices + document_.bytes_of_files() / 2;
  bool any_normals_ = false, any_colours_ = false, any_textures_ = false;
  size_t thin_ = 0, translucent_ = 0, cut_by_texture_ = 0;  // primitives
  size_t hidden_ = 0;                                       // triangles
};

}  // namespace
}  // namespace gltf

Result<Mesh> read_gltf(std::string_view content, const std::string& name, Companions& companions,
                       uint64_t texture_detail) {
  try {
    return gltf::Reader(content, name, companions).read(texture_detail);
  } catch (const Refusal& refusal) {
    return Error{fmt::format("{}: {}", name, refusal.text)};
  } catch (const nlohmann::json::exception& wrong) {
    return Error{fmt::format("{}: its glTF JSON is damaged: {}", name, wrong.what())};
  }
}

}  // namespace telesplat::data
