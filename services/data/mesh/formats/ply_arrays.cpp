#include "services/data/mesh/formats/ply_arrays.h"

#include <fmt/format.h>

#include "common/scene/colouring.h"

namespace telesplat::data {

PlyArrays::PlyArrays(const PlyHeader& header, const std::function<bool(const PlyElement&, std::string_view)>& is_taken)
    : header_(header) {
  for (const PlyElement& element : header.elements) {
    const bool vertices = element.name == "vertex", faces = element.name == "face";
    std::vector<int>& of = of_element_.emplace_back(element.properties.size(), -1);
    for (size_t i = 0; i < of.size() && (vertices || faces); ++i) {
      const PlyProperty& p = element.properties[i];
      if (p.is_list || is_taken(element, p.name)) continue;
      of[i] = int(arrays_.size());
      arrays_.push_back({p.name, "", faces, 1, {scene::ValueSpan{}}});
    }
  }
  scene::make_tellable(arrays_);
  for (auto& of : of_element_)  // those that are too many are passed over
    for (int& array : of)
      if (array >= int(arrays_.size())) array = -1;
}

Status PlyArrays::choose(const std::string& text, const std::string& file) {
  const auto choice = scene::choose_array(arrays_, text);
  if (!choice) return Error{fmt::format("{}: {}", file, choice.error().text)};
  chosen_ = int(choice->index);
  return ok_status();
}

const std::vector<int>& PlyArrays::arrays_of(const PlyElement& element) const {
  return of_element_[size_t(&element - header_.elements.data())];
}

void PlyArrays::finish(Mesh& mesh) {
  if (chosen_ >= 0) {
    const double origin = scene::scalar_origin(arrays_[size_t(chosen_)].spans[0]);
    values_.resize(faces_chosen() ? mesh.indices.size() / 3 : mesh.positions.size(), kMissing);
    mesh.scalars.reserve(values_.size());
    for (const double v : values_) mesh.scalars.push_back(scene::stored_scalar(v, origin));
    mesh.scalars_of_faces = faces_chosen();
  }
  mesh.arrays = std::move(arrays_);
}

}  // namespace telesplat::data
