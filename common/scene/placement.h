// Where the data stand in the room: how to undo the placement, so that what people point at is told in the data's own
// coordinates. A data server tells it as the fact "placement".
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>

#include "common/core/result.h"
#include "common/geometry/box.h"

namespace telesplat::scene {

inline constexpr const char* kPlacementFact = "placement";
inline constexpr size_t kMaxUnit = 40;  ///< bytes of a unit's name

struct Placement {
  glm::dmat4 data_to_room{1.0};  ///< affine, one scale for all axes
  geometry::DBox box_data;       ///< of the data, in their own coordinates; empty: not known
  std::string unit;              ///< of these: "mm"; empty: the data do not say

  bool operator==(const Placement&) const = default;
  glm::dvec3 to_data(const glm::dvec3& room) const;
  glm::dvec3 to_room(const glm::dvec3& data) const;
  /// Of a normal: unit length again.
  glm::dvec3 direction_to_data(const glm::dvec3& room) const;
  /// The data's units that a metre of the room is.
  double units_per_metre() const;
};

/// Of a data set that is turned by `rotation`, scaled and moved so that box_data becomes box_room.
Placement placement_of(const glm::dmat3& rotation, const geometry::DBox& box_data, const geometry::Box& box_room);

/// JSON {"matrix": twelve numbers, row by row, "lo", "hi", "unit"}; comes back to the last bit.
std::string to_text(const Placement& placement);
/// Error: no such text, numbers that are not finite, a matrix without inverse, a box that ends before it begins, a unit
/// that is no short UTF-8.
Result<Placement> placement_from_text(std::string_view text);

}  // namespace telesplat::scene
