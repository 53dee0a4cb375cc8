// The properties of a PLY file that are neither positions nor normals nor colours: arrays that can colour the mesh.
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "services/data/base/mesh.h"
#include "services/data/mesh/formats/ply_header.h"

namespace telesplat::data {

/// Takes the values while the body is read: spans of all arrays, the values of the one that was asked for.
class PlyArrays {
 public:
  /// is_taken: whether a property of an element's vertices or faces is used otherwise.
  PlyArrays(const PlyHeader& header, const std::function<bool(const PlyElement&, std::string_view)>& is_taken);

  /// Asks for an array. Error: there is none of that name, or it is of faces that are not read.
  Status choose(const std::string& text, const std::string& file);

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

}  // namespace telesplat::data
