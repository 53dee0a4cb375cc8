// Clipping as users order it, in the data's own coordinates: --clip and `telesplat ctl clip`. Once the master knows the
// placement, it converts the order to planes in the room and sends them to all processes as the fact "clip".
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/geometry/clip.h"
#include "common/scene/placement.h"

namespace telesplat::scene {

inline constexpr const char* kClipFact = "clip";  ///< geometry::to_text(Clip) of the epoch; absent or empty: uncut
inline constexpr const char* kClipOrderFact = "clip_order";  ///< the order that it came from, for people
inline constexpr size_t kMaxClipOrder = 2000;                ///< bytes of an order

struct ClipOrder {
  /// a * x + b * y + c * z >= d is kept.
  struct Plane {
    glm::dvec3 normal;
    double value = 0;
    bool percent = false;  ///< value is a percentage of the box along x, y or z: 0 at its begin, 100 at its end
  };
  std::vector<Plane> planes;
  bool empty() const { return planes.empty(); }
};

/// Parts separated by ";":
///   plane AXIS>=VALUE, plane AXIS<=VALUE    the kept side; AXIS is x, y or z, VALUE a number or a percentage, "30%"
///   plane A,B,C,D                           A x + B y + C z >= D is kept
///   box X0,Y0,Z0,X1,Y1,Z1                   the inside is kept; each a number or a percentage
///   off                                     alone: nothing is cut away
/// Error: states the problem; more planes than geometry::Clip::kMostPlanes (a box has six).
Result<ClipOrder> parse_clip(std::string_view text);

/// Converts the order to room space. Error: percentages of an unknown box; numbers that are too large.
Result<geometry::Clip> place_clip(const ClipOrder& order, const Placement& placement);

}  // namespace telesplat::scene
