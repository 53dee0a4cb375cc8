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
inline constexpr size_t kMaxUnit = 40;        ///< bytes of a unit's name
inline constexpr size_t kMaxReference = 200;  ///< bytes of a reference system's name

/// What the three numbers of a place mean.
enum class Space {
  kPlain,       ///< x, y and z
  kLps,         ///< a patient's: x towards the left, y to the back, z to the head (DICOM, ITK)
  kRas,         ///< a patient's: x towards the right, y to the front, z to the head (NIfTI)
  kProjected,   ///< easting and northing of a map, height
  kGeographic,  ///< longitude and latitude in degrees, height
};

/// What x, y and z increase towards, a letter each: "LPS", "RAS", "ENz" (east, north, height), "xyz".
const char* axis_letters(Space space);

/// How coordinates of a data set are to be read.
struct Coordinates {
  Space space = Space::kPlain;
  std::string reference;          ///< of maps: "EPSG:32632 WGS 84 / UTM zone 32N"; empty: not said
  std::string unit, height_unit;  ///< of maps: of x and y, and of z, as the file has them: "degrees", "m"
  glm::dvec3 shown{1.0};          ///< what is placed in the room are the coordinates times this: z exaggerated
  glm::dvec3 lengths{1.0};        ///< Placement::unit that one of each coordinate is long
  bool operator==(const Coordinates&) const = default;
};
std::string to_text(const Coordinates& coordinates);  ///< JSON
/// Error: no such text, unknown space, numbers that are not finite or 0, texts that are no UTF-8 or too long.
Result<Coordinates> coordinates_from_text(std::string_view text);

struct Placement {
  glm::dmat4 data_to_room{1.0};  ///< affine
  geometry::DBox box_data;       ///< of the data, in their own coordinates; empty: not known
  std::string unit;              ///< of lengths: "mm"; empty: the data do not say
  Coordinates coordinates;

  bool operator==(const Placement&) const = default;
  glm::dvec3 to_data(const glm::dvec3& room) const;
  /// Of a normal: unit length again.
  glm::dvec3 direction_to_data(const glm::dvec3& room) const;
  /// From one place to another, in `unit`, along x, y and z; of longitudes and latitudes on WGS 84's ellipsoid, to a
  /// millionth over a kilometre.
  glm::dvec3 way(const glm::dvec3& from_data, const glm::dvec3& to_data) const;
  /// How long a vector of the room is in the data, in `unit`.
  double length_of(const glm::dvec3& room) const;
};

/// Of a data set that is turned by `rotation`, scaled and moved so that box_shown, of its coordinates as they are
/// shown, becomes box_room.
Placement placement_of(const glm::dmat3& rotation, const geometry::DBox& box_shown, const geometry::Box& box_room,
                       const Coordinates& coordinates = {});

/// "R 12.300  A 45.600  S 78.900 mm (LPS -12.300, -45.600, 78.900)", "lon 7.1234567, lat 46.1234567, height 1203.250 m
/// (EPSG:4326 WGS 84)", "12.5, 3, 40 mm". The last digit is a millionth of the data's size, of maps at most a
/// millimetre and the seventh of degrees.
std::string place_text(const Placement& placement, const glm::dvec3& data);

/// JSON {"matrix": twelve numbers, row by row, "lo", "hi", "unit", "coordinates"}; comes back to the last bit.
std::string to_text(const Placement& placement);
/// Error: no such text, numbers that are not finite, a matrix without inverse, a box that ends before it begins, a unit
/// that is no short UTF-8.
Result<Placement> placement_from_text(std::string_view text);

}  // namespace telesplat::scene
