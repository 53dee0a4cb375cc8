// Inside services/data/mesh/formats: the parts of a PLY file: its header, the values behind it, arrays that can colour
// the mesh, pictures as MeshLab, CloudCompare and Blender name and place them. Source: G. Turk, "The PLY Polygon File
// Format", 1994.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <glm/vec2.hpp>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "services/data/base/mapped_file.h"
#include "services/data/base/mesh.h"
#include "services/data/base/refusal.h"
#include "services/data/base/stored_type.h"
#include "services/data/base/text_scanner.h"

namespace telesplat::data {

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };

struct PlyProperty {
  std::string name;
  StoredType type = StoredType::kF32;  ///< of a list: of its items
  bool is_list = false;
  StoredType count_type = StoredType::kU8;
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;  ///< as claimed
  std::vector<PlyProperty> properties;

  /// The index of a property, or -1.
  int find(std::string_view property) const;
  /// Fewest bytes that one of these takes in a file of this encoding (lists empty).
  size_t least_bytes(PlyEncoding encoding) const;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
  size_t bytes = 0;                   ///< of the header: where the data starts
  std::vector<std::string> textures;  ///< pictures, of comments "TextureFile", in the order of their numbers

  const PlyElement* find(std::string_view element) const;
};

/// Parses the header. Claimed counts are checked against the size of `content`: what is returned can be allocated by.
/// Limits: 64 elements, 256 properties each, 1,024 textures, a header of 1 MiB. Throws Refusal, starting with `name`.
PlyHeader parse_ply_header(std::string_view content, const std::string& name);

// Reads values, one or `count` of a type, from the data behind the header. read() returns false where the data ends or
// is no number.
class AsciiCursor {
 public:
  AsciiCursor(std::string_view content, size_t offset) : scan_(content.substr(offset)) {}
  bool read(StoredType, double& out) { return scan_.skip_space() && scan_.number(out); }
  bool read(StoredType type, uint64_t count, std::vector<double>& out) {
    out.clear();
    double item;
    for (; out.size() < count && read(type, item);) out.push_back(item);  // a lying count ends at the file's end
    return out.size() == count;
  }

 private:
  TextScanner scan_;
};

template <bool kSwap>
class BinaryCursor {
 public:
  BinaryCursor(std::string_view content, size_t offset)
      : at_(content.data() + offset), end_(content.data() + content.size()) {}
  [[gnu::always_inline]] bool read(StoredType type, double& out) {
    return with_type(type, [&](auto zero) { return take<decltype(zero)>(1, &out); });
  }
  [[gnu::always_inline]] bool read(StoredType type, uint64_t count, std::vector<double>& out) {
    if (count > static_cast<uint64_t>(end_ - at_) / stored_bytes(type)) return false;
    out.resize(count);
    return with_type(type, [&](auto zero) { return take<decltype(zero)>(count, out.data()); });
  }

 private:
  template <class T>
  bool take(size_t count, double* out) {
    if (static_cast<size_t>(end_ - at_) < count * sizeof(T)) return false;
    for (size_t i = 0; i < count; ++i, at_ += sizeof(T)) {
      char bytes[sizeof(T)];
      std::memcpy(bytes, at_, sizeof(T));
      if constexpr (kSwap) std::reverse(bytes, bytes + sizeof(T));
      T value;
      std::memcpy(&value, bytes, sizeof(T));
      out[i] = static_cast<double>(value);
    }
    return true;
  }
  const char* at_;
  const char* end_;
};

/// Takes the values while the body is read: spans of all arrays, the values of the one that was asked for.
class PlyArrays {
 public:
  /// is_taken: whether a property of an element's vertices or faces is used otherwise.
  PlyArrays(const PlyHeader& header, const std::function<bool(const PlyElement&, std::string_view)>& is_taken);

  /// Asks for an array. Error: there is none of that name, or it is of faces that are not read.
  void choose(const std::string& text, const std::string& file);

  /// The array behind each property of this element, -1: none.
  const std::vector<int>& arrays_of(const PlyElement& element) const;

  void take_vertex(int array, double value) {
    arrays_[size_t(array)].spans[0].add(value);
    if (array == chosen_) values_.push_back(value);
  }
  /// A face's value becomes that of its triangles when end_face() says how many the mesh has by now.
  void take_face(int array, double value) {
    arrays_[size_t(array)].spans[0].add(value);
    if (array == chosen_) of_this_face_ = value;
  }
  void end_face(size_t triangles) {
    if (faces_chosen()) values_.resize(triangles, std::exchange(of_this_face_, kMissing));
  }

  /// Puts what was taken into the mesh, whose vertices and triangles are complete.
  void finish(Mesh& mesh);

 private:
  bool faces_chosen() const { return chosen_ >= 0 && arrays_[size_t(chosen_)].of_cells; }

  static constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

  const PlyHeader& header_;
  std::vector<std::vector<int>> of_element_;  // [element][property]
  std::vector<scene::ArrayInfo> arrays_;
  int chosen_ = -1;
  std::vector<double> values_;
  double of_this_face_ = kMissing;
};

/// Takes the corners of triangles while the body is read, then bakes the pictures into the mesh's colours.
class PlyTextures {
 public:
  /// texture: the picture's place among the header's; any number may stand there. place: v goes up from the picture's
  /// lower rim; a place that is no number: the triangle has no picture.
  void add_corner(double texture, glm::vec2 place);

  /// Vertices are doubled where places or pictures differ. The picture's colours replace those of vertices.
  /// pictures: the header's. Error: a picture is damaged or too large. Precondition: three corners for each triangle,
  /// and every index is below the number of vertices.
  void bake(Mesh& mesh, const std::vector<std::string>& pictures, const std::string& name, Companions& companions,
            uint64_t texture_detail) const;

 private:
  struct Corner {
    uint32_t picture;
    glm::vec2 place;
    bool operator==(const Corner&) const = default;
  };
  std::vector<Corner> corners_;
};

}  // namespace telesplat::data
