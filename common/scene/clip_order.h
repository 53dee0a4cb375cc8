// What people ask to be cut away, in the data's own coordinates: --clip and `telesplat ctl clip`. The master makes
// planes in the room of it, once it knows the placement, and tells everyone these as the fact "clip".
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/geometry/clip.h"
#include "common/scene/placement.h"

namespace telesplat::scene {

inline constexpr const char* kClipFact = "clip";  ///< geometry::to_text(Clip) of the epoch; absent or empty: none
inline constexpr const char* kClipOrderFact = "clip_order";  ///< the order that it came from, for people
inline constexpr size_t kMaxClipOrder = 2000;                ///< bytes of an order

struct ClipOrder {
  /// a * x + b * y + c * z >= d is kept.
  struct Plane {
    glm::dvec3 normal;
    double value = 0;
    bool percent = false;  ///< value is a share of the box: 0 where x, y or z begins, 100 where it ends
  };
  std::vector<Plane> planes;
  bool empty() const { return planes.empty(); }
};

/// Parts separated by ";":
///   plane AXIS>=VALUE, plane AXIS<=VALUE    what is kept; AXIS is x, y or z, VALUE a number or a percentage, "30%"
///   plane A,B,C,D                           A x + B y + C z >= D is kept
///   box X0,Y0,Z0,X1,Y1,Z1                   what lies inside is kept; each a number or a percentage
///   off                                     alone: nothing is cut away
/// Error: what is wrong with it; more planes than geometry::Clip::kMostPlanes (a box has six).
Result<ClipOrder> parse_clip(std::string_view text);

/// The same in the room. Error: percentages of a box that is not known; numbers that are too large.
Result<geometry::Clip> place_clip(const ClipOrder& order, const Placement& placement);

}  // namespace telesplat::scene
