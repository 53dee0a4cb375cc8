// Reads Wavefront OBJ. Source: "Object Files (.obj)", Wavefront Advanced Visualizer manual, appendix B1.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <unordered_map>

#include "services/data/base/polygons/polygon.h"
#include "services/data/base/raw_colours.h"
#include "services/data/base/refusal.h"
#include "services/data/base/text_scanner.h"
#include "services/data/mesh/formats/obj_materials.h"
#include "services/data/mesh/formats/readers.h"
#include "services/data/texture/texture.h"

namespace telesplat::data {
namespace {

constexpr uint32_t kNone = ~uint32_t{0};
constexpr int kMostSteps = 64;  // through a position's corners: a million normals at one place cost no hours

// Corners of the output mesh: a position with one normal, one material and, where that has a texture, one place in it.
class Corners {
 public:
  struct Corner {
    uint32_t normal, material, place, position;
    bool operator==(const Corner&) const = default;
  };

  // Returns the number of this corner, which is new or has been there before.
  uint32_t number_of(const Corner& corner) {
    if (first_.size() <= corner.position) first_.resize(corner.position + 1, kNone);
    int steps = 0;
    for (uint32_t c = first_[corner.position]; c != kNone && ++steps <= kMostSteps; c = next_[c])
      if (corners_[c] == corner) return c;
    const auto id = static_cast<uint32_t>(corners_.size());
    corners_.push_back(corner);
    next_.push_back(first_[corner.position]);
    return first_[corner.position] = id;
  }
  const std::vector<Corner>& all() const { return corners_; }

 private:
  std::vector<Corner> corners_;
  std::vector<uint32_t> first_, next_;  // newest corner of each position; the corner of the same position before
};

class ObjReader {
 public:
  ObjReader(std::string_view content, const std::string& name, const ReadProgress& progress, Companions& companions,
            uint64_t texture_detail)
      : content_(content),
        name_(name),
        progress_(progress),
        companions_(companions),
        texture_detail_(texture_detail),
        scan_(content) {}

  Mesh read() {
    read_materials();
    mesh_.format = "obj";
    for (size_t lines = 0; scan_.skip_space('#'); scan_.next_line(), ++lines) {
      const std::string_view word = scan_.word();
      if (word == "v") read_vertex();
      if (word == "vn") read_normal();
      if (word == "vt") read_texture_coordinate();
      if (word == "f") read_face();
      if (word == "usemtl") use_material();
      if (word == "l" || word == "p" || word == "curv" || word == "surf") ++others_;
      if ((lines & 0xffff) == 0 && progress_)
        progress_(static_cast<double>(scan_.offset()) / static_cast<double>(content_.size()));
    }
    if (mesh_.indices.empty() && mesh_.degenerate_dropped == 0)
      refuse("{}: holds no faces, only {} vertices and {} lines, points, curves and surfaces", name_, positions_.size(),
             others_);
    if (others_ > 0)
      mesh_.notes.push_back(fmt::format("{}: its {} lines, points, curves and surfaces are left out", name_, others_));
    return finish();
  }

 private:
  using Corner = Corners::Corner;

  void read_materials() {
    std::map<int64_t, uint32_t> looks;
    std::vector<std::string> missing;
    const auto libraries = obj_material_libraries(content_, companions_);
    for (auto& [name, material] : read_obj_materials(libraries, companions_, missing)) {
      // Materials without texture and of equal colour share a number: fewer vertices are doubled.
      const auto next = uint32_t(materials_.size());
      const int64_t look = material.colour ? int64_t(*material.colour) : -1;
      const uint32_t number = material.texture.empty() ? looks.emplace(look, next).first->second : next;
      material_numbers_.emplace(name, number);
      if (number == next) materials_.push_back(std::move(material));
    }
    for (const std::string& library : missing)
      mesh_.notes.push_back(
          fmt::format("{}: the material library {} is not there; its colours are left out", name_, library));
  }

  template <class... Given>
  [[noreturn]] void bad(fmt::format_string<Given...> what, Given&&... given) const {
    refuse("{}:{}: {}", name_, scan_.line_number(), fmt::format(what, std::forward<Given>(given)...));
  }

  // True if the statement goes on: on the same line, or on the next one after a backslash.
  bool more() {
    while (scan_.skip_blanks('#')) {
      if (!scan_.skip_char('\\')) return true;
      scan_.next_line();
    }
    return false;
  }

  void read_vertex() {
    double value[7];
    int count = 0;
    while (count < 7 && more() && scan_.number(value[count])) ++count;
    if (count < 3) bad("a vertex is not three numbers");
    positions_.emplace_back(value[0], value[1], value[2]);
    if (count >= 6) {  // x y z r g b, as MeshLab and others write it; x y z w r g b does not occur
      colours_.fill(positions_.size() - 1);
      colours_.add({value[3], value[4], value[5]});
    }
  }

  void read_normal() {
    glm::dvec3 n;
    for (int a = 0; a < 3; ++a)
      if (!more() || !scan_.number(n[a])) bad("a normal is not three numbers");
    normals_.emplace_back(n);
  }

  // u [v [w]]; v grows from the picture's lower edge upwards.
  void read_texture_coordinate() {
    double u = 0, v = 0;
    if (!more() || !scan_.number(u)) bad("a texture coordinate is no number");
    if (more()) scan_.number(v);
    places_.emplace_back(u, v);
  }

  void use_material() {
    const auto found = material_numbers_.find(rest_of_line(content_, scan_.offset()));
    material_ = found == material_numbers_.end() ? kNone : found->second;
  }

  // Converts an index: 1-based, or negative: counted back from the last element so far.
  bool resolve(int64_t index, size_t count, uint32_t& out) const {
    const int64_t zero_based = index > 0 ? index - 1 : index < 0 ? static_cast<int64_t>(count) + index : -1;
    if (zero_based < 0 || zero_based >= static_cast<int64_t>(count)) return false;
    out = static_cast<uint32_t>(zero_based);
    return true;
  }

  // Reads position[/[texture][/normal]].
  uint32_t read_corner() {
    int64_t index = 0;
    uint32_t position = 0, normal = kNone, place = kNone;
    if (!scan_.integer(index)) bad("a face's corner is no number");
    if (!resolve(index, positions_.size(), position))
      bad("a face names vertex {}, there are {} so far", index, positions_.size());
    if (scan_.skip_char('/')) {
      if (scan_.integer(index) && !resolve(index, places_.size(), place))
        bad("a face names texture coordinate {}, there are {} so far", index, places_.size());
      if (scan_.skip_char('/') && scan_.integer(index) && !resolve(index, normals_.size(), normal))
        bad("a face names normal {}, there are {} so far", index, normals_.size());
    }
    const bool textured = material_ != kNone && !materials_[material_].texture.empty();
    return corners_.number_of({normal, material_, textured ? place : kNone, position});
  }

  void read_face() {
    face_.clear();
    while (more()) face_.push_back(read_corner());
    if (face_.size() < 3) ++mesh_.degenerate_dropped;
    if (face_.size() == 3) mesh_.indices.insert(mesh_.indices.end(), face_.begin(), face_.end());
    if (face_.size() > 3) cut_face();
  }

  void cut_face() {
    ring_.clear(), cut_.clear();
    for (const uint32_t corner : face_) ring_.push_back(corners_.all()[corner].position);
    cut_corners(ring_, positions_, cut_);
    for (const uint32_t i : cut_) mesh_.indices.push_back(face_[i]);
  }

  uint32_t colour_of(const Corner& v, uint32_t own, bool own_colours, bool textured) const {
    const auto kd = v.material == kNone ? std::nullopt : materials_[v.material].colour;
    // A material tints its texture; many programs write black beside a texture and mean no tint.
    if (textured) return kd && *kd != 0 ? *kd : 0xffffff;
    return !own_colours && kd ? *kd : own;
  }

  Mesh finish() {
    auto use = read_textures();
    const bool own_colours = !colours_.empty();  // they take precedence over materials
    bool any_colour = own_colours || !use.textures.empty(), any_normal = false;
    for (const Corner& v : corners_.all())
      any_colour |= v.material != kNone && materials_[v.material].colour, any_normal |= v.normal != kNone;
    colours_.fill(positions_.size());
    const auto vertex_colours = colours_.packed(kNeutralAlbedo);
    mesh_.positions.reserve(corners_.all().size());
    for (const Corner& v : corners_.all()) {
      mesh_.positions.push_back(positions_[v.position]);
      const uint32_t texture = v.material == kNone || v.place == kNone ? kNoTexture : textures_of_[v.material];
      if (any_colour)
        mesh_.colours.push_back(colour_of(v, vertex_colours[v.position], own_colours, texture != kNoTexture));
      if (any_normal)
        mesh_.normals.push_back(v.normal != kNone ? normals_[v.normal] : glm::vec3(0));  // 0: to be computed
      if (use.textures.empty()) continue;
      use.texture.push_back(texture);
      use.uv.push_back(texture == kNoTexture ? glm::vec2(0) : place_in_picture(v));
    }
    if (!use.textures.empty() && drop_not_finite(mesh_, name_))
      if (std::string note = bake_textures(mesh_, std::move(use), texture_detail_); !note.empty())
        mesh_.notes.push_back(name_ + ": " + note);
    return std::move(mesh_);
  }

  glm::vec2 place_in_picture(const Corner& v) const {
    const ObjMaterial& m = materials_[v.material];
    const glm::vec2 uv = places_[v.place] * m.scale + m.offset;
    return {uv.x, 1 - uv.y};
  }

  // Loads the textures that faces use.
  TextureUse read_textures() {
    NamedTextures textures(name_, companions_);
    textures_of_.assign(materials_.size(), kNoTexture);
    std::vector<bool> used(materials_.size(), false);
    for (const Corner& v : corners_.all())
      if (v.material != kNone && v.place != kNone) used[v.material] = true;
    for (size_t m = 0; m < materials_.size(); ++m) {
      const ObjMaterial& material = materials_[m];
      if (!used[m] || material.texture.empty()) continue;
      const auto number = textures.number_of(material.texture, material.clamp ? Wrap::kClamp : Wrap::kRepeat);
      textures_of_[m] = number;
      if (!material.not_applied.empty())
        mesh_.notes.push_back(fmt::format("{}: the option {} of the texture {} is not applied", name_,
                                          material.not_applied, material.texture));
    }
    mesh_.notes.insert(mesh_.notes.end(), textures.notes().begin(), textures.notes().end());
    return TextureUse{textures.all(), {}, {}};
  }

  std::string_view content_;
  const std::string& name_;
  const ReadProgress& progress_;
  Companions& companions_;
  const uint64_t texture_detail_;
  TextScanner scan_;
  Mesh mesh_;
  std::vector<glm::dvec3> positions_;
  std::vector<glm::vec3> normals_;
  RawColours colours_;  // empty, or one per vertex
  Corners corners_;
  std::vector<glm::vec2> places_;  // texture coordinates
  std::unordered_map<std::string, uint32_t> material_numbers_;
  std::vector<ObjMaterial> materials_;
  std::vector<uint32_t> textures_of_;  // per material: its number in TextureUse::textures, or kNoTexture
  uint32_t material_ = kNone;
  std::vector<uint32_t> face_, ring_, cut_;  // buffers for the current face
  size_t others_ = 0;                        // number of statements left out
};

}  // namespace

Result<Mesh> read_obj(std::string_view content, const std::string& name, const ReadProgress& progress,
                      Companions& companions, uint64_t texture_detail) {
  return or_error([&] { return ObjReader(content, name, progress, companions, texture_detail).read(); });
}

}  // namespace telesplat::data
