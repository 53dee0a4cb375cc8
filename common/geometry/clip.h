// What is cut away of a scene: all that lies on the far side of one of several planes. What is kept is convex, so that
// a line has one stretch of it.
#pragma once

#include <glm/vec3.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"
#include "common/geometry/box.h"

namespace telesplat::geometry {

/// Keeps the points p with dot(normal, p) >= offset.
struct ClipPlane {
  glm::dvec3 normal{0, 1, 0};  ///< unit length, room space, towards what is kept
  double offset = 0;           ///< metres

  bool operator==(const ClipPlane&) const = default;
  /// How far on the kept side a point lies, metres; below 0: it is cut away.
  double inside_m(const glm::dvec3& room) const {
    return normal.x * room.x + normal.y * room.y + normal.z * room.z - offset;
  }
};

struct Clip {
  static constexpr size_t kMostPlanes = 8;  ///< a box and two planes; what OpenGL promises for clip distances

  std::vector<ClipPlane> planes;  ///< none: everything is kept

  bool operator==(const Clip&) const = default;
  bool empty() const { return planes.empty(); }
  /// tolerance_m: how far beyond a plane still counts.
  bool keeps(const glm::dvec3& room, double tolerance_m = 0) const;

  enum class Part { kAll, kSome, kNone };
  /// How much of a box is kept. kSome may be said of a box of which nothing is kept, near an edge of the planes.
  Part part_of(const Box& box_room) const;

  /// The stretch of a line that is kept, in units of its direction; empty where begin > end.
  struct Stretch {
    double begin, end;
    bool empty() const { return begin > end; }
    /// What of it lies in a box as well.
    Stretch within(const DBox& box, const glm::dvec3& origin, const glm::dvec3& direction) const;
  };
  Stretch stretch(const glm::dvec3& origin_room, const glm::dvec3& direction) const;
};

/// The text that travels: "NX NY NZ OFFSET" a plane, separated by ";"; empty: everything is kept. Numbers come back to
/// the last bit.
std::string to_text(const Clip& clip);
/// Error: no such text, more than kMostPlanes, numbers that are not finite or beyond 1e9, a normal that is not of unit
/// length (to a millionth).
Result<Clip> clip_from_text(std::string_view text);

}  // namespace telesplat::geometry
