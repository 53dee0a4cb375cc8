// Reads PLY. Source: G. Turk, "The PLY polygon file format", 1994.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <type_traits>

#include "common/scene/colouring.h"
#include "services/data/base/polygons/polygon.h"
#include "services/data/base/raw_colours.h"
#include "services/data/cloud/cloud.h"
#include "services/data/mesh/formats/ply.h"
#include "services/data/mesh/formats/readers.h"

namespace telesplat::data {
namespace {

// Use of a vertex's or face's property.
enum class Target : uint8_t { kNone, kX, kY, kZ, kNormalX, kNormalY, kNormalZ, kRed, kGreen, kBlue, kU, kV, kCount };

// textured: the file names a picture, so that these names mean texture coordinates.
Target target_of(std::string_view name, bool textured) {
  constexpr std::string_view kNames[] = {"",
                                         "|x|",
                                         "|y|",
                                         "|z|",
                                         "|nx|",
                                         "|ny|",
                                         "|nz|",
                                         "|red|r|diffuse_red|",
                                         "|green|g|diffuse_green|",
                                         "|blue|b|diffuse_blue|",
                                         "|s|u|texture_u|",
                                         "|t|v|texture_v|"};
  static_assert(std::size(kNames) == size_t(Target::kCount));
  const std::string word = '|' + std::string(name) + '|';
  for (size_t i = 1; i < (textured ? std::size(kNames) : size_t(Target::kU)); ++i)
    if (kNames[i].find(word) != word.npos) return Target(i);
  return Target::kNone;
}

// The targets of an element's properties, and the set of targets that it has.
struct Targets {
  Targets(const PlyElement& element, bool textured) {
    for (const PlyProperty& p : element.properties) {
      of.push_back(p.is_list ? Target::kNone : target_of(p.name, textured));
      has[size_t(of.back())] = true;
      if (of.back() == Target::kRed) colour_type = p.type;
    }
  }
  bool all(std::initializer_list<Target> targets) const {
    return std::all_of(targets.begin(), targets.end(), [&](Target t) { return has[size_t(t)]; });
  }
  bool colours() const { return all({Target::kRed, Target::kGreen, Target::kBlue}); }

  std::vector<Target> of;
  bool has[size_t(Target::kCount)] = {};
  StoredType colour_type = StoredType::kU8;
};

using Values = std::array<double, size_t(Target::kCount)>;

glm::vec3 colour_of(const Values& v) {
  return {v[size_t(Target::kRed)], v[size_t(Target::kGreen)], v[size_t(Target::kBlue)]};
}

// Full value of a channel, at least: bytes and 16-bit integers count up to 255 in any case.
float least_full(StoredType type) { return stored_bytes(type) <= 2 ? 255 : 1; }

template <class Cursor>
class PlyBody {
 public:
  PlyBody(const PlyHeader& header, std::string_view content, const std::string& name, const ReadProgress& progress)
      : header_(header),
        name_(name),
        progress_(progress),
        content_bytes_(content.size()),
        cursor_(content, header.bytes),
        textured_(!header.textures.empty()),
        arrays_(header, [this](const PlyElement& element, std::string_view property) {
          const Target target = target_of(property, textured_);
          if (element.name == "vertex") return target != Target::kNone;
          return target >= Target::kRed && target <= Target::kBlue && Targets(element, textured_).colours();
        }) {
    for (const PlyElement& e : header.elements) total_ += e.count;
  }

  /// array: the array that colours the mesh; empty: no array.
  Mesh read(const std::string& array, Companions& companions, uint64_t texture_detail) {
    mesh_.format = "ply";
    if (!array.empty()) arrays_.choose(array, name_);
    const auto is_vertex = [](const PlyElement& e) { return e.name == "vertex"; };
    const auto vertices = std::find_if(header_.elements.begin(), header_.elements.end(), is_vertex);
    const bool faces_first = vertices != header_.elements.end() &&
                             std::any_of(header_.elements.begin(), vertices,
                                         [](const PlyElement& e) { return e.name == "face" || e.name == "tristrips"; });
    if (faces_first) {
      const Cursor start = cursor_;
      for (auto e = header_.elements.begin(); e != vertices; ++e) skip(*e);
      read_vertices(*vertices);
      cursor_ = start;
    }
    for (const PlyElement& element : header_.elements) {
      if (is_vertex(element) && !(faces_first && &element == &*vertices))
        read_vertices(element);
      else if (element.name == "face" || element.name == "tristrips")
        read_faces(element, element.name == "tristrips");
      else
        skip(element);
    }
    arrays_.finish(mesh_);
    if (mesh_.indices.empty() && mesh_.degenerate_dropped == 0 && !mesh_.positions.empty()) return cloud();
    if (array.empty()) colour_triangles(companions, texture_detail);
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void ended(const PlyElement& element, uint64_t at) const {
    refuse("{}: is truncated or damaged: {} {} of {} cannot be read", name_, element.name, at, element.count);
  }
  // Vertices without faces.
  Mesh cloud() {
    const PlyElement* vertices = header_.find("vertex");
    if (vertices && (vertices->find("f_dc_0") >= 0 || vertices->find("packed_position") >= 0))
      refuse("{}: holds {} Gaussian splats and no triangles: splats of other programs are not read", name_,
             mesh_.positions.size());
    mesh_.format = fmt::format("PLY points ({})", header_.encoding == PlyEncoding::kAscii ? "ascii" : "binary");
    return need(SquareCloud::make({std::move(mesh_), {}, false}, name_))->mesh();
  }
  // Colours triangles by their pictures, else by their own colours.
  void colour_triangles(Companions& companions, uint64_t texture_detail) {
    const size_t triangles = mesh_.indices.size() / 3;
    if (textured_ && places_) return textures_.bake(mesh_, header_.textures, name_, companions, texture_detail);
    if (face_colours_.empty()) return;
    face_colours_.fill(triangles);
    colour_faces(mesh_, face_colours_.packed(kNoColour, face_colours_least_));
    return;
  }
  void tick() {
    if ((++done_ & 0x3ffff) == 0 && progress_) progress_(static_cast<double>(done_) / static_cast<double>(total_));
  }

  bool read_list(const PlyProperty& property, std::vector<double>& list) {
    double count = 0;
    if (!cursor_.read(property.count_type, count) || count < 0 || count > static_cast<double>(content_bytes_))
      return false;
    return cursor_.read(property.type, static_cast<uint64_t>(count), list);
  }

  void read_vertices(const PlyElement& element) {
    if (!mesh_.positions.empty()) refuse("{}: has two elements 'vertex'", name_);
    const Targets targets(element, textured_);
    if (!targets.all({Target::kX, Target::kY, Target::kZ})) refuse("{}: element 'vertex' lacks x, y or z", name_);
    if (element.count > kMaxVertices) refuse("{}: {} vertices, the limit is {}", name_, element.count, kMaxVertices);
    const bool normals = targets.all({Target::kNormalX, Target::kNormalY, Target::kNormalZ}),
               colours = targets.colours(), bytes = targets.colour_type == StoredType::kU8,
               places = targets.all({Target::kU, Target::kV});
    RawColours raw_colours;
    mesh_.positions.reserve(element.count);
    if (normals) mesh_.normals.reserve(element.count);
    if (colours) mesh_.colours.reserve(element.count);
    const std::vector<int>& arrays = arrays_.arrays_of(element);
    Values value{};
    const auto at = [&](Target t) { return value[size_t(t)]; };
    for (uint64_t v = 0; v < element.count; ++v, tick()) {
      for (size_t i = 0; i < targets.of.size(); ++i) {
        const PlyProperty& p = element.properties[i];
        if (p.is_list ? !read_list(p, list_) : !cursor_.read(p.type, value[size_t(targets.of[i])])) ended(element, v);
        if (arrays[i] >= 0) arrays_.take_vertex(arrays[i], at(Target::kNone));
      }
      mesh_.positions.emplace_back(at(Target::kX), at(Target::kY), at(Target::kZ));
      if (normals) mesh_.normals.emplace_back(at(Target::kNormalX), at(Target::kNormalY), at(Target::kNormalZ));
      if (places) places_of_vertices_.emplace_back(at(Target::kU), at(Target::kV));
      if (colours && bytes)
        mesh_.colours.push_back(
            pack_rgb(uint32_t(at(Target::kRed)), uint32_t(at(Target::kGreen)), uint32_t(at(Target::kBlue))));
      else if (colours)
        raw_colours.add(colour_of(value));
    }
    if (!raw_colours.empty()) mesh_.colours = raw_colours.packed(kNeutralAlbedo, least_full(targets.colour_type));
    places_ |= places;
  }

  void read_faces(const PlyElement& element, bool strips) {
    int corners = element.find("vertex_indices");
    if (corners < 0) corners = element.find("vertex_index");
    if (corners < 0 || !element.properties[corners].is_list)
      refuse("{}: element '{}' lacks the list vertex_indices", name_, element.name);
    const int places = textured_ ? element.find("texcoord") : -1, picture = textured_ ? element.find("texnumber") : -1;
    places_ |= places >= 0 && element.properties[places].is_list;
    const Targets targets(element, textured_);
    const bool colours = targets.colours(), corners_alone = element.properties.size() == 1;
    if (colours) face_colours_least_ = least_full(targets.colour_type);
    const size_t item_bytes = stored_bytes(element.properties[corners].type);
    mesh_.indices.reserve(mesh_.indices.size() + std::min<uint64_t>(3 * element.count, content_bytes_ / item_bytes));
    const std::vector<int>& arrays = arrays_.arrays_of(element);
    Values value{};
    double number_of_picture = 0;
    const auto read_face = [&] {
      places_list_.clear();
      for (size_t i = 0; i < element.properties.size(); ++i) {
        const PlyProperty& p = element.properties[i];
        double& single = value[size_t(targets.of[i])];
        auto& list = int(i) == corners ? list_ : int(i) == places ? places_list_ : ignored_;
        if (p.is_list ? !read_list(p, list) : !cursor_.read(p.type, single)) return false;
        if (arrays[i] >= 0) arrays_.take_face(arrays[i], single);
        if (int(i) == picture && !p.is_list) number_of_picture = single;
      }
      return true;
    };
    for (uint64_t f = 0; f < element.count; ++f, tick()) {
      if (corners_alone ? !read_list(element.properties[0], list_) : !read_face()) ended(element, f);
      const size_t before = mesh_.indices.size();
      strips ? add_strip(element, f) : add_polygon(element, f);
      if (mesh_.indices.size() > 3 * kMaxTriangles) refuse("{}: more than {} triangles", name_, kMaxTriangles);
      arrays_.end_face(mesh_.indices.size() / 3);
      if (colours) face_colours_.fill(before / 3);
      for (size_t i = before; i < mesh_.indices.size() && colours; i += 3) face_colours_.add(colour_of(value));
      if (textured_) add_places(number_of_picture, before);
    }
  }

  bool is_vertex(double index) const { return index >= 0 && index < double(mesh_.positions.size()); }
  [[noreturn]] void no_vertex(const PlyElement& element, uint64_t face, double index) const {
    refuse("{}: {} {} names vertex {}, there are {}", name_, element.name, face, index, mesh_.positions.size());
  }

  // Adds the face in list_; sets cut_ and ring_, except for triangles without a picture, the usual case.
  void add_polygon(const PlyElement& element, uint64_t face) {
    const double* c = list_.data();
    if (list_.size() != 3 || textured_ || !is_vertex(c[0]) || !is_vertex(c[1]) || !is_vertex(c[2]))
      return cut_face(element, face);
    for (int k = 0; k < 3; ++k) mesh_.indices.push_back(uint32_t(c[k]));
  }

  void cut_face(const PlyElement& element, uint64_t face) {
    for (const double index : list_)
      if (!is_vertex(index)) no_vertex(element, face, index);
    if (list_.size() < 3) ++mesh_.degenerate_dropped;
    ring_.assign(list_.begin(), list_.end());
    cut_.clear();
    cut_corners(ring_, mesh_.positions, cut_);
    for (const uint32_t i : cut_) mesh_.indices.push_back(ring_[i]);
  }

  // Adds triangle strips: corners one after the other, -1 between strips.
  void add_strip(const PlyElement& element, uint64_t face) {
    ring_.clear(), cut_.clear();
    for (const double index : list_) {
      if (!is_vertex(index) && index != -1) no_vertex(element, face, index);
      ring_.push_back(index == -1 ? kBreak : uint32_t(index));
    }
    uint32_t start = 0;
    for (uint32_t i = 0; i < ring_.size(); ++i) {
      const bool odd = (i - start) % 2 == 1;
      if (ring_[i] == kBreak)
        start = i + 1;
      else if (i >= start + 2)
        cut_.insert(cut_.end(), {i - 2, odd ? i : i - 1, odd ? i - 1 : i});
    }
    for (const uint32_t i : cut_) mesh_.indices.push_back(ring_[i]);
  }

  // Adds texture coordinates of the corners in cut_: the face's own, or those of its vertices.
  void add_places(double picture, size_t first_index) {
    const bool own = places_list_.size() >= 2 * ring_.size();
    for (size_t k = 0; k < cut_.size(); ++k) {
      const uint32_t i = cut_[k], vertex = mesh_.indices[first_index + k];
      textures_.add_corner(picture, own ? glm::vec2(places_list_[2 * i], places_list_[2 * i + 1])
                                    : !places_of_vertices_.empty() ? places_of_vertices_[vertex]
                                                                   : glm::vec2(RawColours::kNone));
    }
  }

  void skip(const PlyElement& element) {
    for (uint64_t n = 0; n < element.count; ++n, tick())
      for (const PlyProperty& p : element.properties) {
        double ignored;
        if (p.is_list ? !read_list(p, ignored_) : !cursor_.read(p.type, ignored)) ended(element, n);
      }
  }

  const PlyHeader& header_;
  const std::string& name_;
  const ReadProgress& progress_;
  size_t content_bytes_;
  static constexpr uint32_t kBreak = ~uint32_t{0};

  Cursor cursor_;
  const bool textured_;  // the header names pictures
  bool places_ = false;  // there are texture coordinates
  PlyArrays arrays_;
  PlyTextures textures_;
  std::vector<glm::vec2> places_of_vertices_;
  RawColours face_colours_;  // empty, or one per triangle
  float face_colours_least_ = 1;
  Mesh mesh_;
  std::vector<double> list_, places_list_, ignored_;  // for the current face
  std::vector<uint32_t> ring_, cut_;
  uint64_t done_ = 0, total_ = 0;
};

}  // namespace

Result<Mesh> read_ply(std::string_view content, const std::string& name, const ReadProgress& progress,
                      Companions& companions, const std::string& array, uint64_t texture_detail) {
  return or_error([&] {
    const PlyHeader header = parse_ply_header(content, name);
    const auto read = [&]<class Cursor>(std::type_identity<Cursor>) {
      return PlyBody<Cursor>(header, content, name, progress).read(array, companions, texture_detail);
    };
    if (header.encoding == PlyEncoding::kAscii) return read(std::type_identity<AsciiCursor>());
    const bool swap = (header.encoding == PlyEncoding::kLittleEndian) != (std::endian::native == std::endian::little);
    return swap ? read(std::type_identity<BinaryCursor<true>>()) : read(std::type_identity<BinaryCursor<false>>());
  });
}

namespace {

// Finds where each number of a vertex lies. Returns false for what RandomMesh does not read.
bool lay_out_vertices(const PlyElement& vertices, RandomMesh::Facts& facts, RecordMesh::Layout& layout) {
  const Targets targets(vertices, false);
  std::array<RecordMesh::Field, size_t(Target::kCount)> field;
  for (size_t i = 0; i < vertices.properties.size(); ++i) {
    const PlyProperty& p = vertices.properties[i];
    if (p.is_list) return false;
    field[size_t(targets.of[i])] = {layout.vertex_bytes, p.type};
    layout.vertex_bytes += stored_bytes(p.type);
  }
  const auto three = [&](Target first) {
    const auto* f = &field[size_t(first)];
    return RecordMesh::Fields{f[0], f[1], f[2]};
  };
  layout.position = three(Target::kX);
  layout.normal = three(Target::kNormalX), layout.colour = three(Target::kRed);
  facts.normals = targets.all({Target::kNormalX, Target::kNormalY, Target::kNormalZ});
  facts.colours = targets.colours();
  return targets.all({Target::kX, Target::kY, Target::kZ}) &&
         (!targets.colours() || targets.colour_type == StoredType::kU8);
}

// Finds the arrays of the vertices: their spans, and where the chosen one lies.
void find_arrays(const PlyHeader& header, const std::string& name, const std::string& array, RecordMesh& mesh) {
  PlyArrays arrays(header, [](const PlyElement& element, std::string_view property) {
    return element.name != "vertex" || target_of(property, false) != Target::kNone;
  });
  if (!array.empty()) arrays.choose(array, name);
  const std::vector<int>& of = arrays.arrays_of(header.elements[0]);
  size_t at = 0;
  for (size_t i = 0; i < of.size(); ++i) {
    const RecordMesh::Field field{at, header.elements[0].properties[i].type};
    at += stored_bytes(field.type);
    if (of[i] < 0) continue;
    scene::ValueSpan& span = arrays.span_of(of[i]);
    for (uint64_t v = 0; v < mesh.vertices(); ++v) span.add(mesh.number(v, field));
    if (arrays.is_chosen(of[i])) mesh.choose_scalar(field, scene::scalar_origin(span));
  }
  mesh.set_arrays(arrays.infos());
}

}  // namespace

Result<std::shared_ptr<const RandomMesh>> random_ply(const std::shared_ptr<const MappedFile>& file,
                                                     const std::string& name, const std::string& array) {
  using Found = std::shared_ptr<const RandomMesh>;
  return or_error([&]() -> Found {
    const PlyHeader header = parse_ply_header(file->text(), name);
    const auto& elements = header.elements;
    if (header.encoding == PlyEncoding::kAscii || !header.textures.empty() || elements.size() != 2 ||
        elements[0].name != "vertex" || elements[1].name != "face" || elements[1].properties.size() != 1)
      return nullptr;
    const PlyProperty& corners = elements[1].properties[0];
    if (!corners.is_list || !corners.name.starts_with("vertex_ind") || corners.type >= StoredType::kU64) return nullptr;
    RandomMesh::Facts facts{.format = "ply", .vertices = elements[0].count, .triangles = elements[1].count};
    RecordMesh::Layout l;
    const size_t count_bytes = stored_bytes(corners.count_type);
    l.corners = {0, corners.count_type}, l.first_corner = {count_bytes, corners.type};
    l.triangle_bytes = count_bytes + 3 * stored_bytes(corners.type);
    l.swap = (header.encoding == PlyEncoding::kLittleEndian) != (std::endian::native == std::endian::little);
    if (!lay_out_vertices(elements[0], facts, l) || facts.vertices > kMaxVertices || facts.triangles > kMaxTriangles)
      return nullptr;
    l.vertices_at = header.bytes, l.triangles_at = header.bytes + facts.vertices * l.vertex_bytes;
    if (l.triangles_at + facts.triangles * l.triangle_bytes != file->bytes().size()) return nullptr;
    const auto mesh = std::make_shared<RecordMesh>(file, std::move(facts), l);
    find_arrays(header, name, array, *mesh);
    return mesh;
  });
}

}  // namespace telesplat::data
