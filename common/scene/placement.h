// Placement of the data in the room, and its inverse, so that places that users point at are reported in the data's own
// coordinates. A data server sends it as the fact "placement".
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>

#include "common/core/result.h"
#include "common/geometry/box.h"

namespace telesplat::scene {

inline constexpr const char* kPlacementFact = "placement";
inline constexpr size_t kMaxUnit = 40;        ///< bytes of a unit's name
inline constexpr size_t kMaxReference = 200;  ///< bytes of a reference system's name

/// Meaning of the three numbers of a place.
enum class Space {
  kPlain,       ///< x, y and z
  kLps,         ///< a patient's: x towards the left, y to the back, z to the head (DICOM, ITK)
  kRas,         ///< a patient's: x towards the right, y to the front, z to the head (NIfTI)
  kProjected,   ///< easting and northing of a map, height
  kGeographic,  ///< longitude and latitude in degrees, height
};

/// Directions in which x, y and z increase, a letter each: "LPS", "RAS", "ENz" (east, north, height), "xyz".
const char* axis_letters(Space space);

/// Meaning and units of a data set's coordinates.
struct Coordinates {
  Space space = Space::kPlain;
  std::string reference;          ///< for maps: "EPSG:32632 WGS 84 / UTM zone 32N"; empty: not stated
  std::string unit, height_unit;  ///< for maps: of x and y, and of z, as the file states them: "degrees", "m"
  glm::dvec3 shown{1.0};          ///< the room shows the coordinates times this: z exaggerated
  glm::dvec3 lengths{1.0};        ///< length of one unit of each coordinate, in Placement::unit
  bool operator==(const Coordinates&) const = default;
};
std::string to_text(const Coordinates& coordinates);  ///< JSON
/// Error: another form, unknown space, numbers that are not finite or 0, texts that are not UTF-8 or too long.
Result<Coordinates> coordinates_from_text(std::string_view text);

struct Placement {
  glm::dmat4 data_to_room{1.0};  ///< affine
  geometry::DBox box_data;       ///< box of the data, in their own coordinates; empty: not known
  std::string unit;              ///< unit of lengths: "mm"; empty: the data do not state it
  Coordinates coordinates;

  bool operator==(const Placement&) const = default;
  glm::dvec3 to_data(const glm::dvec3& room) const;
  /// Converts a normal; the result has unit length again.
  glm::dvec3 direction_to_data(const glm::dvec3& room) const;
  /// Way from one place to another, in `unit`, along x, y and z. Longitudes and latitudes are taken on WGS 84's
  /// ellipsoid, to a millionth over a kilometre.
  glm::dvec3 way(const glm::dvec3& from_data, const glm::dvec3& to_data) const;
  /// Length of a vector of the room in the data, in `unit`.
  double length_of(const glm::dvec3& room) const;
};

/// Placement of a data set that is turned by `rotation`, scaled and moved so that box_shown (in coordinates as shown)
/// becomes box_room.
Placement placement_of(const glm::dmat3& rotation, const geometry::DBox& box_shown, const geometry::Box& box_room,
                       const Coordinates& coordinates = {});

/// Text of a place: "R 12.300  A 45.600  S 78.900 mm (LPS -12.300, -45.600, 78.900)", "lon 7.1234567, lat 46.1234567,
/// height 1203.250 m (EPSG:4326 WGS 84)", "12.5, 3, 40 mm". The last digit is a millionth of the data's size; on maps
/// it is a millimetre or less, and the seventh digit of degrees or a later one.
std::string place_text(const Placement& placement, const glm::dvec3& data);

/// Writes JSON {"matrix": twelve numbers, row by row, "lo", "hi", "unit", "coordinates"}, exact to the last bit.
std::string to_text(const Placement& placement);
/// Error: another form, numbers that are not finite, a matrix without inverse, an inverted box, a unit that is not a
/// short UTF-8 text.
Result<Placement> placement_from_text(std::string_view text);

}  // namespace telesplat::scene
