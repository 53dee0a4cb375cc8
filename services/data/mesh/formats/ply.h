// Inside services/data/mesh/formats: the parts of a PLY file: its header, the values behind it, arrays that can colour
// the mesh, pictures with names and coordinates as MeshLab, CloudCompare and Blender write them. Source: G. Turk, "The
// PLY Polygon File Format", 1994.
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
  StoredType type = StoredType::kF32;  ///< type of the items, if a list
  bool is_list = false;
  StoredType count_type = StoredType::kU8;
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;  ///< as claimed
  std::vector<PlyProperty> properties;

  /// Returns the index of a property, or -1.
  int find(std::string_view property) const;
  /// Returns the fewest bytes of one such element in a file of this encoding (lists empty).
  size_t least_bytes(PlyEncoding encoding) const;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
  size_t bytes = 0;                   ///< length of the header: offset of the data
  std::vector<std::string> textures;  ///< pictures from comments "TextureFile", in order of their numbers

  const PlyElement* find(std::string_view element) const;
};

/// Parses the header. Claimed counts are checked against the size of `content`: memory may be allocated by them.
/// Limits: 64 elements, 256 properties each, 1,024 textures, a header of 1 MiB. Throws Refusal, starting with `name`.
PlyHeader parse_ply_header(std::string_view content, const std::string& name);

// Reads values, one or `count` of a type, from the data behind the header. read() returns false at the data's end, or
// if they are not a number.
class AsciiCursor {
 public:
  AsciiCursor(std::string_view content, size_t offset) : scan_(content.substr(offset)) {}
  bool read(StoredType, double& out) { return scan_.skip_space() && scan_.number(out); }
  bool read(StoredType type, uint64_t count, std::vector<double>& out) {
    out.clear();
    double item;
    for (; out.size() < count && read(type, item);) out.push_back(item);  // a false count ends with the file
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

/// Collects values while the body is read: spans of all arrays, and the values of the requested one.
class PlyArrays {
 public:
  /// is_taken: true if a property of an element's vertices or faces has another use.
  PlyArrays(const PlyHeader& header, const std::function<bool(const PlyElement&, std::string_view)>& is_taken);

  /// Selects an array. Error: no array has that name, or its faces are not read.
  void choose(const std::string& text, const std::string& file);

  /// Returns the array of each property of this element; -1: no array.
  const std::vector<int>& arrays_of(const PlyElement& element) const;

  void take_vertex(int array, double value) {
    arrays_[size_t(array)].spans[0].add(value);
    if (array == chosen_) values_.push_back(value);
  }
  /// Takes a face's value; end_face() gives it to the face's triangles, with the mesh's number of triangles so far.
  void take_face(int array, double value) {
    arrays_[size_t(array)].spans[0].add(value);
    if (array == chosen_) of_this_face_ = value;
  }
  void end_face(size_t triangles) {
    if (faces_chosen()) values_.resize(triangles, std::exchange(of_this_face_, kMissing));
  }

  scene::ValueSpan& span_of(int array) { return arrays_[size_t(array)].spans[0]; }
  bool is_chosen(int array) const { return array == chosen_; }
  const std::vector<scene::ArrayInfo>& infos() const { return arrays_; }

  /// Puts the collected values into the mesh, whose vertices and triangles are complete.
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

/// Collects the corners of triangles while the body is read, then bakes the pictures into the mesh's colours.
class PlyTextures {
 public:
  /// texture: the picture's index in the header; it may be invalid. place: v grows from the picture's lower edge
  /// upwards; NaN: the triangle has no picture.
  void add_corner(double texture, glm::vec2 place);

  /// Doubles vertices where coordinates or pictures differ, and replaces their colours by the picture's. pictures: the
  /// header's. Error: a picture is damaged or too large. Precondition: three corners for each triangle, and every index
  /// is below the number of vertices.
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
