// Clipping of a scene: cuts away all parts on the far side of one of several planes. The kept part is convex, so that
// it has at most one stretch of a line.
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
  glm::dvec3 normal{0, 1, 0};  ///< unit length, room space, towards the kept side
  double offset = 0;           ///< metres

  bool operator==(const ClipPlane&) const = default;
  /// Distance of a point on the kept side, metres; below 0: it is cut away.
  double inside_m(const glm::dvec3& room) const {
    return normal.x * room.x + normal.y * room.y + normal.z * room.z - offset;
  }
};

struct Clip {
  static constexpr size_t kMostPlanes = 8;  ///< a box and two planes; OpenGL guarantees as many clip distances

  std::vector<ClipPlane> planes;  ///< empty: everything is kept

  bool operator==(const Clip&) const = default;
  bool empty() const { return planes.empty(); }
  /// tolerance_m: distance beyond a plane that still counts as kept.
  bool keeps(const glm::dvec3& room, double tolerance_m = 0) const;

  enum class Part { kAll, kSome, kNone };
  /// Returns the kept part of a box. Near an edge of the planes it may return kSome for a box that is wholly cut away.
  Part part_of(const Box& box_room) const;

  /// The kept stretch of a line, in units of its direction; empty if begin > end.
  struct Stretch {
    double begin, end;
    bool empty() const { return begin > end; }
    /// The part of it that also lies in a box.
    Stretch within(const DBox& box, const glm::dvec3& origin, const glm::dvec3& direction) const;
  };
  Stretch stretch(const glm::dvec3& origin_room, const glm::dvec3& direction) const;
};

/// Writes "NX NY NZ OFFSET" a plane, separated by ";", for messages; empty: everything is kept. Numbers come back to
/// the last bit.
std::string to_text(const Clip& clip);
/// Error: another form, more than kMostPlanes, numbers that are not finite or beyond 1e9, a normal whose length differs
/// from 1 by more than a millionth.
Result<Clip> clip_from_text(std::string_view text);

}  // namespace telesplat::geometry
