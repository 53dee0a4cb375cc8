// The head's movement, as --trajectory, --eye, --look-at and --loop give it. Parts that depend on the data set's box
// are worked out once it is known.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/geometry/trajectory.h"

namespace telesplat::viewer {

struct HeadMovement {
  bool orbits = false;                                   ///< around the data set, as near as shows all of it
  std::shared_ptr<const geometry::Trajectory> recorded;  ///< from a file; without this and orbits the head stands still
  /// Place and aim of the first view, metres in the room; nothing: fitted to the data set, its centre.
  std::optional<glm::dvec3> eye, look_at;

  /// Returns the first view of a data set. frustum: the whole picture's, or that of its free part, whose middle lies at
  /// the tangent middle_x; its pose means nothing.
  geometry::Pose first_view(const geometry::Box& box_room, const geometry::Camera& frustum, double middle_x = 0) const;
  /// Returns the trajectory that the head follows.
  geometry::Trajectory trajectory(const geometry::Box& box_room, const geometry::Camera& frustum) const;
};

/// name: "orbit", "still", or a CSV file, which is read. Error: names the file and what is wrong, or lists the names
/// that there are.
Result<HeadMovement> head_movement(const std::string& name, bool loop);

/// "x,y,z" in metres. Error: what is wrong with it, without the flag's name.
Result<glm::dvec3> parse_point(const std::string& text);

}  // namespace telesplat::viewer
