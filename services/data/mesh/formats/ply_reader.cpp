// PLY. Source: G. Turk, "The PLY polygon file format", 1994.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "services/data/base/text_scanner.h"
#include "services/data/mesh/formats/ply_arrays.h"
#include "services/data/mesh/formats/ply_header.h"
#include "services/data/mesh/reader.h"

namespace telesplat::data {
namespace {

// Reads one value after the other from the data behind the header. read() returns false where the data ends or is no
// number.
class AsciiCursor {
 public:
  AsciiCursor(std::string_view content, size_t offset) : scan_(content.substr(offset)) {}
  bool read(PlyType, double& out) { return scan_.skip_space() && scan_.number(out); }

 private:
  TextScanner scan_;
};

template <bool kSwap>
class BinaryCursor {
 public:
  BinaryCursor(std::string_view content, size_t offset)
      : at_(content.data() + offset), end_(content.data() + content.size()) {}
  bool read(PlyType type, double& out) {
    switch (type) {
      case PlyType::kInt8:
        return take<int8_t>(out);
      case PlyType::kUint8:
        return take<uint8_t>(out);
      case PlyType::kInt16:
        return take<int16_t>(out);
      case PlyType::kUint16:
        return take<uint16_t>(out);
      case PlyType::kInt32:
        return take<int32_t>(out);
      case PlyType::kUint32:
        return take<uint32_t>(out);
      case PlyType::kFloat32:
        return take<float>(out);
      case PlyType::kFloat64:
        return take<double>(out);
    }
    return false;
  }

 private:
  template <class T>
  bool take(double& out) {
    if (static_cast<size_t>(end_ - at_) < sizeof(T)) return false;
    char bytes[sizeof(T)];
    std::memcpy(bytes, at_, sizeof(T));
    if constexpr (kSwap) std::reverse(bytes, bytes + sizeof(T));
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    out = static_cast<double>(value);
    at_ += sizeof(T);
    return true;
  }
  const char* at_;
  const char* end_;
};

// Where a property of a vertex goes.
enum class Target : uint8_t { kNone, kX, kY, kZ, kNormalX, kNormalY, kNormalZ, kRed, kGreen, kBlue, kCount };

Target target_of(std::string_view name) {
  constexpr std::pair<std::string_view, Target> kTargets[] = {{"x", Target::kX},
                                                              {"y", Target::kY},
                                                              {"z", Target::kZ},
                                                              {"nx", Target::kNormalX},
                                                              {"ny", Target::kNormalY},
                                                              {"nz", Target::kNormalZ},
                                                              {"red", Target::kRed},
                                                              {"green", Target::kGreen},
                                                              {"blue", Target::kBlue},
                                                              {"r", Target::kRed},
                                                              {"g", Target::kGreen},
                                                              {"b", Target::kBlue},
                                                              {"diffuse_red", Target::kRed},
                                                              {"diffuse_green", Target::kGreen},
                                                              {"diffuse_blue", Target::kBlue}};
  for (const auto& [word, target] : kTargets)
    if (word == name) return target;
  return Target::kNone;
}

// The factor that brings a colour channel of this type to 0..255.
double channel_scale(PlyType type) {
  if (type == PlyType::kFloat32 || type == PlyType::kFloat64) return 255.0;
  return kPlyTypeBytes[static_cast<int>(type)] == 2 ? 255.0 / 65535.0 : 1.0;
}

uint32_t channel(double value) { return value > 0 ? static_cast<uint32_t>(std::min(value + 0.5, 255.0)) : 0; }

template <class Cursor>
class PlyBody {
 public:
  PlyBody(const PlyHeader& header, std::string_view content, const std::string& name, const ReadProgress& progress)
      : header_(header),
        name_(name),
        progress_(progress),
        content_bytes_(content.size()),
        cursor_(content, header.bytes),
        arrays_(header, [](std::string_view property) { return target_of(property) != Target::kNone; }) {
    for (const PlyElement& e : header.elements) total_ += e.count;
  }

  /// array: what the mesh is coloured by; empty: nothing.
  Result<Mesh> read(const std::string& array) {
    mesh_.format = "ply";
    if (!array.empty())
      if (const Status s = arrays_.choose(array, name_); !s) return s.error();
    for (const PlyElement& element : header_.elements) {
      const Status status = element.name == "vertex"      ? read_vertices(element)
                            : element.name == "face"      ? read_faces(element, false)
                            : element.name == "tristrips" ? read_faces(element, true)
                                                          : skip(element);
      if (!status.ok()) return status.error();
    }
    arrays_.finish(mesh_);
    return std::move(mesh_);
  }

 private:
  Error ended(const PlyElement& element, uint64_t at) const {
    return Error{
        fmt::format("{}: is truncated or damaged: {} {} of {} cannot be read", name_, element.name, at, element.count)};
  }
  void tick() {
    if ((++done_ & 0x3ffff) == 0 && progress_) progress_(static_cast<double>(done_) / static_cast<double>(total_));
  }

  // Reads a list's items into list_.
  bool read_list(const PlyProperty& property) {
    double count = 0;
    if (!cursor_.read(property.count_type, count) || count < 0 || count > static_cast<double>(content_bytes_))
      return false;
    list_.clear();
    for (double i = 0; i < count; ++i) {  // grows as items arrive, so a lying count ends at the file's end
      double item;
      if (!cursor_.read(property.type, item)) return false;
      list_.push_back(item);
    }
    return true;
  }

  Status read_vertices(const PlyElement& element) {
    if (!mesh_.positions.empty()) return Error{name_ + ": has two elements 'vertex'"};
    bool has[static_cast<int>(Target::kCount)] = {};
    std::vector<Target> targets;
    double scale = 1.0;
    for (const PlyProperty& p : element.properties) {
      targets.push_back(p.is_list ? Target::kNone : target_of(p.name));
      has[static_cast<int>(targets.back())] = true;
      if (targets.back() == Target::kRed) scale = channel_scale(p.type);
    }
    const auto all = [&](Target a, Target b, Target c) {
      return has[static_cast<int>(a)] && has[static_cast<int>(b)] && has[static_cast<int>(c)];
    };
    if (!all(Target::kX, Target::kY, Target::kZ)) return Error{name_ + ": element 'vertex' lacks x, y or z"};
    if (element.count > kMaxVertices)
      return Error{fmt::format("{}: {} vertices, the limit is {}", name_, element.count, kMaxVertices)};
    const bool normals = all(Target::kNormalX, Target::kNormalY, Target::kNormalZ),
               colours = all(Target::kRed, Target::kGreen, Target::kBlue);
    mesh_.positions.reserve(element.count);
    if (normals) mesh_.normals.reserve(element.count);
    if (colours) mesh_.colours.reserve(element.count);
    const std::vector<int>& arrays = arrays_.arrays_of(element);
    for (uint64_t v = 0; v < element.count; ++v, tick()) {
      double value[static_cast<int>(Target::kCount)] = {};
      for (size_t i = 0; i < targets.size(); ++i) {
        const PlyProperty& p = element.properties[i];
        if (p.is_list ? !read_list(p) : !cursor_.read(p.type, value[static_cast<int>(targets[i])]))
          return ended(element, v);
        if (arrays[i] >= 0) arrays_.take_vertex(arrays[i], value[static_cast<int>(Target::kNone)]);
      }
      const auto at = [&](Target t) { return value[static_cast<int>(t)]; };
      mesh_.positions.emplace_back(at(Target::kX), at(Target::kY), at(Target::kZ));
      if (normals) mesh_.normals.emplace_back(at(Target::kNormalX), at(Target::kNormalY), at(Target::kNormalZ));
      if (colours)
        mesh_.colours.push_back(pack_rgb(channel(at(Target::kRed) * scale), channel(at(Target::kGreen) * scale),
                                         channel(at(Target::kBlue) * scale)));
    }
    return ok_status();
  }

  // A vertex index as it stands in the file.
  Status add_index(double value, const PlyElement& element, uint64_t face) {
    if (!(value >= 0 && value <= static_cast<double>(kMaxVertices)))
      return Error{fmt::format("{}: {} {} names vertex {}", name_, element.name, face, value)};
    mesh_.indices.push_back(static_cast<uint32_t>(value));
    return ok_status();
  }
  Status add_triangle(double a, double b, double c, const PlyElement& element, uint64_t face) {
    for (double corner : {a, b, c})
      if (auto status = add_index(corner, element, face); !status) return status;
    return ok_status();
  }

  Status read_faces(const PlyElement& element, bool strips) {
    int corners = element.find("vertex_indices");
    if (corners < 0) corners = element.find("vertex_index");
    if (corners < 0 || !element.properties[corners].is_list)
      return Error{fmt::format("{}: element '{}' lacks the list vertex_indices", name_, element.name)};
    const size_t item_bytes = kPlyTypeBytes[static_cast<int>(element.properties[corners].type)];
    mesh_.indices.reserve(mesh_.indices.size() + std::min<uint64_t>(3 * element.count, content_bytes_ / item_bytes));
    const std::vector<int>& arrays = arrays_.arrays_of(element);
    for (uint64_t f = 0; f < element.count; ++f, tick()) {
      for (size_t i = 0; i < element.properties.size(); ++i) {
        const PlyProperty& p = element.properties[i];
        double value;
        if (p.is_list ? !read_list(p) : !cursor_.read(p.type, value)) return ended(element, f);
        if (arrays[i] >= 0) arrays_.take_face(arrays[i], value);
        if (static_cast<int>(i) == corners)
          if (auto status = strips ? add_strip(element, f) : add_polygon(element, f); !status) return status;
      }
      arrays_.end_face(mesh_.indices.size() / 3);
      if (mesh_.indices.size() > 3 * kMaxTriangles)
        return Error{fmt::format("{}: more than {} triangles", name_, kMaxTriangles)};
    }
    return ok_status();
  }

  Status add_polygon(const PlyElement& element, uint64_t face) {
    if (list_.size() < 3) ++mesh_.degenerate_dropped;
    for (size_t i = 2; i < list_.size(); ++i)
      if (auto status = add_triangle(list_[0], list_[i - 1], list_[i], element, face); !status) return status;
    return ok_status();
  }

  // Corners of strips, one after the other, -1 between them.
  Status add_strip(const PlyElement& element, uint64_t face) {
    size_t start = 0;
    for (size_t i = 0; i < list_.size(); ++i) {
      if (list_[i] == -1)
        start = i + 1;
      else if (i >= start + 2) {
        const bool odd = (i - start) % 2 == 1;
        if (auto status = add_triangle(list_[i - 2], list_[odd ? i : i - 1], list_[odd ? i - 1 : i], element, face);
            !status)
          return status;
      }
    }
    return ok_status();
  }

  Status skip(const PlyElement& element) {
    for (uint64_t n = 0; n < element.count; ++n, tick())
      for (const PlyProperty& p : element.properties) {
        double ignored;
        if (p.is_list ? !read_list(p) : !cursor_.read(p.type, ignored)) return ended(element, n);
      }
    return ok_status();
  }

  const PlyHeader& header_;
  const std::string& name_;
  const ReadProgress& progress_;
  size_t content_bytes_;
  Cursor cursor_;
  PlyArrays arrays_;
  Mesh mesh_;
  std::vector<double> list_;
  uint64_t done_ = 0, total_ = 0;
};

}  // namespace

Result<Mesh> read_ply(std::string_view content, const std::string& name, const ReadProgress& progress,
                      const std::string& array) {
  const auto header = parse_ply_header(content, name);
  if (!header) return header.error();
  constexpr bool kLittle = std::endian::native == std::endian::little;
  switch (header->encoding) {
    case PlyEncoding::kAscii:
      return PlyBody<AsciiCursor>(*header, content, name, progress).read(array);
    case PlyEncoding::kLittleEndian:
      return PlyBody<BinaryCursor<!kLittle>>(*header, content, name, progress).read(array);
    case PlyEncoding::kBigEndian:
      return PlyBody<BinaryCursor<kLittle>>(*header, content, name, progress).read(array);
  }
  return Error{name + ": unknown PLY encoding"};
}

}  // namespace telesplat::data
