// A quaternion Julia set as a scene (T4.2.2, T7.3): its parameters, their names and limits. Traces no rays.
//
// The filled-in set of f(q) = q^2 + c is cut by a three-dimensional hyperplane of the quaternions. Set space is that
// hyperplane's own coordinates (X, Y, Z), with X to the right, Y up and Z towards the viewer, as in room space.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "common/core/result.h"
#include "common/geometry/box.h"

namespace telesplat::julia {

/// Source of a point's colour; the number is the parameter's value.
enum class Colour {
  kDistance = 0,   ///< distance from the set's centre, the quaternion 0 (T4.2.2)
  kTrap = 1,       ///< least distance of the orbit from the real axis
  kTrapPlane = 2,  ///< least distance of the orbit from the plane through 0 that is normal to j
};

/// Quaternions are (x, y, z, w) = (i, j, k, real), as glm stores them.
struct Parameters {
  glm::dvec4 c{0.0, 0.0, 0.0, 0.0};  ///< the constant; each component in [-4, 4]
  double slice_offset = 0;           ///< distance of the slice from 0 along its normal (k, turned), in [-4, 4]
  glm::dvec3 slice_turn_deg{
      0.0};  ///< turns of the slice, one after the other, in the planes (1, k), (i, k), (j, k); in [-360, 360]
  int iterations = 64;  ///< most iterations of f, 1..4096; an orbit that has not escaped by then is inside
  double bailout = 16;  ///< |q| beyond which an orbit has escaped, 2..1e6
  double lod = 0.5;     ///< the surface lies at this distance estimate, in pixel footprints, 0.05..16
  double bound = 0;     ///< half side of the visible cube about 0 in set space, at most 8; 0: the set's own box
  Colour colour = Colour::kDistance;
  int palette = 0;          ///< index into palette_names()
  double colour_scale = 1;  ///< number of times that palettes repeat from 0 to the set's radius, 0.01..100
  double colour_shift = 0;  ///< place of 0 in the palette, in [-100, 100]; whole numbers change nothing
  double ambient = 0.6;     ///< strength of the ambient occlusion that darkens colours, 0 (off)..1
  double shadow = 0;        ///< strength of the soft shadow of a light at the upper left in front, 0 (off)..1
  bool operator==(const Parameters&) const = default;
};

/// Description of a parameter. Its name is used on the command line, in scene files, in messages and for animation:
/// "c.x", "c.y", "c.z", "c.w", "slice.offset", "slice.turn-x", "slice.turn-y", "slice.turn-z", "iterations", "bailout",
/// "lod", "bound", "colour", "palette", "colour.scale", "colour.shift", "ambient", "shadow".
struct ParameterInfo {
  std::string_view name;
  double least, most;
  bool whole;             ///< takes whole numbers only
  bool animates;          ///< may change from one epoch to the next; if also not whole, it can be animated
  std::string_view text;  ///< for --help
};
std::span<const ParameterInfo> parameter_infos();

/// Error: no such name (lists the valid ones), not finite, out of [least, most], not whole. States name, value and
/// limits.
Status set(Parameters& parameters, std::string_view name, double value);
/// Precondition: a name of parameter_infos().
double get(const Parameters& parameters, std::string_view name);

/// All parameters by name, for messages.
std::map<std::string, double> to_map(const Parameters& parameters);
/// Ignores other names (messages hold others too); missing parameters keep their default; the rest as set() does.
Result<Parameters> from_map(const std::map<std::string, double>& values);

/// Checks that each value is within its limits, that the slice is near enough to 0 to meet the set, and that the
/// bailout is beyond the ball that holds the set. Error texts name parameter, value and limit.
Status validate(const Parameters& parameters);

struct Preset {
  std::string_view name, text;  ///< text: one line for people
  Parameters parameters;
};
/// Sets that look good; the first is the default.
std::span<const Preset> presets();
/// Error: no such preset; lists the valid names.
Result<Parameters> preset_named(std::string_view name);

std::span<const std::string_view> palette_names();
std::span<const std::string_view> colour_names();  ///< "distance", "trap", "trap-plane", in the order of Colour

/// The slice in the quaternions: q = origin + X e[0] + Y e[1] + Z e[2], e orthonormal.
struct Slice {
  glm::dvec4 origin;
  std::array<glm::dvec4, 3> e;
};
Slice slice(const Parameters& parameters);

/// Radius of a ball about 0 that holds the filled-in set: (1 + sqrt(1 + 4 |c|)) / 2.
double radius(const glm::dvec4& c);

/// Box of the set in set space: refines cells of a grid unless all their orbits provably escape, and adds a cell on
/// each side, so the box is never too small. `bound` > 0: that cube instead. Empty if the slice (in that cube) misses
/// the set. About 10 ms. Precondition: validate(parameters).
geometry::DBox bounds(const Parameters& parameters);

/// Set space in room space: room = (set - centre) * scale. Fixed for a session, so that an animated set does not jump.
struct Placement {
  glm::dvec3 centre{0.0};
  double scale = 1;        ///< metres a unit of set space
  geometry::Box box_room;  ///< the visible part; rays are clipped to it
};
/// Centres the box in the room and scales its largest extent to room_size_m. Precondition: !box.empty().
Placement place(const geometry::DBox& box, double room_size_m);
/// "room.x", "room.y", "room.z", "room.scale", for messages, and back. Errors name the value that is missing or not a
/// finite number.
std::map<std::string, double> to_map(const Placement& placement);
Result<Placement> placement_from_map(const std::map<std::string, double>& values, const geometry::Box& box_room);

}  // namespace telesplat::julia
