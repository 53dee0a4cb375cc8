// A wall of screens: where each stands, how large its picture is, how many pixels it has. One head looks at all of them
// (T1.2, T7.4).
//
// The wall has axes of its own: metres, right-handed, +y up, and a person before it looks along -z. A screen's pose
// takes its own axes there: its picture lies in x and y around the origin, and is seen from +z.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/geometry/camera.h"

namespace telesplat::wall {

/// Most screens that a wall may have.
inline constexpr int kMostScreens = 256;

/// Metres from the picture's edges to the outer edges of the screen.
struct Bezel {
  double left = 0, right = 0, bottom = 0, top = 0;
  bool operator==(const Bezel&) const = default;
};

struct Screen {
  std::string name;                  ///< "planar 1, row 2, column 1", for people
  geometry::Pose pose;               ///< the middle of its picture, in the wall's axes
  double width_m = 0, height_m = 0;  ///< its picture's size
  int width = 0, height = 0;         ///< pixels
  Bezel bezel;
  int node = 0;  ///< number of the computer that drives it, from 0
  /// Pixels to sample for it, width x height; nothing: as the viewer's flags say.
  std::optional<std::pair<int, int>> sampling;
  /// Where the middle of its picture lies on the wall unrolled, metres to the right and up.
  glm::dvec2 unrolled_m{0.0};
};

/// The frame in which the wall stands still.
enum class Anchor {
  kRoom,  ///< it stands in the room; the head moves before it, and only the head's position changes the pictures
  kHead   ///< it moves with the head, which is always at Wall::head: as if the wall were one large display before it
};

struct Wall {
  std::string name;
  Anchor anchor = Anchor::kRoom;
  geometry::Pose in_room;       ///< Anchor::kRoom: pose of the wall's axes
  glm::dvec3 head{0.0};         ///< the eyes' place unless they are tracked, in the wall's axes
  std::vector<Screen> screens;  ///< in the order of their names in the file; grids by rows from the upper left

  int nodes() const;
  /// Screens of a node, in order.
  std::vector<int> screens_of(int node) const;
};

/// Reads a wall's description (docs/walls.md). Errors name file, line, key, value and limit.
Result<Wall> read_wall(const std::string& path);
/// The same from a text; `path` is named by errors.
Result<Wall> parse_wall(const std::string& text, const std::string& path);

/// Multiplies the pixels of all screens by `scale` on each axis, at least 16 a side: to try a wall on a small machine.
/// Precondition: 0 < scale <= 1.
Wall scaled(Wall wall, double scale);

}  // namespace telesplat::wall
