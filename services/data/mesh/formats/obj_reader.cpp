// Wavefront OBJ. Source: "Object Files (.obj)", Wavefront Advanced Visualizer manual, appendix B1.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <unordered_map>

#include "services/data/base/mapped_file.h"
#include "services/data/base/text_scanner.h"
#include "services/data/mesh/reader.h"

namespace telesplat::data {
namespace {

uint32_t colour_of(const double (&c)[3]) {
  const auto channel = [](double v) { return v > 0 ? static_cast<uint32_t>(std::min(v * 255 + 0.5, 255.0)) : 0; };
  return pack_rgb(channel(c[0]), channel(c[1]), channel(c[2]));
}

// The diffuse colours of a material library; a library that cannot be read has none.
void read_materials(const std::string& path, std::unordered_map<std::string, uint32_t>& colours) {
  const auto file = MappedFile::open(path);
  if (!file) return;
  TextScanner scan((*file)->text());
  std::string material;
  for (; scan.skip_space('#'); scan.next_line()) {
    const std::string_view word = scan.word();
    if (word == "newmtl" && scan.skip_blanks()) material = scan.word();
    double c[3];
    if (word == "Kd" && scan.skip_blanks() && scan.number(c[0]) && scan.skip_blanks() && scan.number(c[1]) &&
        scan.skip_blanks() && scan.number(c[2]))
      colours[material] = colour_of(c);
  }
}

constexpr uint32_t kNone = ~uint32_t{0};

class ObjReader {
 public:
  ObjReader(std::string_view content, const std::string& name, const ReadProgress& progress)
      : content_(content), name_(name), progress_(progress), scan_(content) {}

  Result<Mesh> read() {
    for (const std::string& library : companion_files(content_, "obj", name_)) read_materials(library, materials_);
    mesh_.format = "obj";
    for (size_t lines = 0; scan_.skip_space('#'); scan_.next_line(), ++lines) {
      const std::string_view word = scan_.word();
      const Status status = word == "v"    ? read_vertex()
                            : word == "vn" ? read_normal()
                            : word == "f"  ? read_face()
                                           : ok_status();
      if (!status.ok()) return status.error();
      if (word == "usemtl") use_material();
      if ((lines & 0xffff) == 0 && progress_)
        progress_(static_cast<double>(scan_.offset()) / static_cast<double>(content_.size()));
    }
    finish();
    return std::move(mesh_);
  }

 private:
  // A corner of the output mesh: a position with one normal and one material. Those of one position form a list.
  struct Variant {
    uint32_t normal, colour, vertex, next;
  };

  Error bad(const std::string& what) const { return Error{fmt::format("{}:{}: {}", name_, scan_.line_number(), what)}; }

  Status read_vertex() {
    double value[7];
    int count = 0;
    while (count < 7 && scan_.skip_blanks('#') && scan_.number(value[count])) ++count;
    if (count < 3) return bad("a vertex is not three numbers");
    positions_.emplace_back(value[0], value[1], value[2]);
    if (count >= 6) {  // x y z r g b, as MeshLab and others write it; x y z w r g b does not occur
      const double c[3] = {value[3], value[4], value[5]};
      vertex_colours_.resize(positions_.size() - 1, kNeutralAlbedo);
      vertex_colours_.push_back(colour_of(c));
    }
    return ok_status();
  }

  Status read_normal() {
    glm::dvec3 n;
    for (int a = 0; a < 3; ++a)
      if (!scan_.skip_blanks('#') || !scan_.number(n[a])) return bad("a normal is not three numbers");
    normals_.emplace_back(n);
    return ok_status();
  }

  void use_material() {
    scan_.skip_blanks();
    const auto found = materials_.find(std::string(scan_.word()));
    material_colour_ = found == materials_.end() ? kNone : found->second;
  }

  // 1-based, or negative: counted back from the last one so far.
  bool resolve(int64_t index, size_t count, uint32_t& out) const {
    const int64_t zero_based = index > 0 ? index - 1 : index < 0 ? static_cast<int64_t>(count) + index : -1;
    if (zero_based < 0 || zero_based >= static_cast<int64_t>(count)) return false;
    out = static_cast<uint32_t>(zero_based);
    return true;
  }

  // position[/[texture][/normal]]
  Status read_corner(uint32_t& out) {
    int64_t index = 0, ignored = 0;
    uint32_t position = 0, normal = kNone;
    if (!scan_.integer(index)) return bad("a face's corner is no number");
    if (!resolve(index, positions_.size(), position))
      return bad(fmt::format("a face names vertex {}, there are {} so far", index, positions_.size()));
    if (scan_.skip_char('/')) {
      scan_.integer(ignored);
      if (scan_.skip_char('/') && scan_.integer(index) && !resolve(index, normals_.size(), normal))
        return bad(fmt::format("a face names normal {}, there are {} so far", index, normals_.size()));
    }
    out = variant_of(position, normal);
    return ok_status();
  }

  uint32_t variant_of(uint32_t position, uint32_t normal) {
    if (first_variant_.size() < positions_.size()) first_variant_.resize(positions_.size(), kNone);
    for (uint32_t v = first_variant_[position]; v != kNone; v = variants_[v].next)
      if (variants_[v].normal == normal && variants_[v].colour == material_colour_) return v;
    const auto id = static_cast<uint32_t>(variants_.size());
    variants_.push_back({normal, material_colour_, position, first_variant_[position]});
    return first_variant_[position] = id;
  }

  Status read_face() {
    uint32_t first = 0, previous = 0;
    size_t corners = 0;
    for (; scan_.skip_blanks('#'); ++corners) {
      if (scan_.skip_char('\\')) {  // the line goes on below
        scan_.next_line();
        --corners;
        continue;
      }
      uint32_t corner = 0;
      if (auto status = read_corner(corner); !status) return status;
      if (corners == 0) first = corner;
      if (corners >= 2) mesh_.indices.insert(mesh_.indices.end(), {first, previous, corner});
      previous = corner;
    }
    if (corners < 3) ++mesh_.degenerate_dropped;
    return ok_status();
  }

  void finish() {
    const bool own_colours = !vertex_colours_.empty();  // they win over materials
    bool any_colour = own_colours, any_normal = false;
    for (const Variant& v : variants_) any_colour |= v.colour != kNone, any_normal |= v.normal != kNone;
    vertex_colours_.resize(positions_.size(), kNeutralAlbedo);
    mesh_.positions.reserve(variants_.size());
    for (const Variant& v : variants_) {
      mesh_.positions.push_back(positions_[v.vertex]);
      if (any_colour) mesh_.colours.push_back(!own_colours && v.colour != kNone ? v.colour : vertex_colours_[v.vertex]);
      if (any_normal)
        mesh_.normals.push_back(v.normal != kNone ? normals_[v.normal] : glm::vec3(0));  // without one: computed later
    }
  }

  std::string_view content_;
  const std::string& name_;
  const ReadProgress& progress_;
  TextScanner scan_;
  Mesh mesh_;
  std::vector<glm::dvec3> positions_;
  std::vector<glm::vec3> normals_;
  std::vector<uint32_t> vertex_colours_, first_variant_;
  std::vector<Variant> variants_;
  std::unordered_map<std::string, uint32_t> materials_;
  uint32_t material_colour_ = kNone;
};

}  // namespace

Result<Mesh> read_obj(std::string_view content, const std::string& name, const ReadProgress& progress) {
  return ObjReader(content, name, progress).read();
}

}  // namespace telesplat::data
