// What moves the head, as --trajectory, --eye, --look-at and --loop say it. What depends on the data set's box is
// worked out once that is known.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/geometry/trajectory.h"

namespace telesplat::viewer {

struct HeadMovement {
  bool orbits = false;                                   ///< around the data set, as near as all of it is seen
  std::shared_ptr<const geometry::Trajectory> recorded;  ///< of a file; neither: the head stands still
  /// Where the first view stands and looks, metres in the room; nothing: fitted to the data set, its centre.
  std::optional<glm::dvec3> eye, look_at;

  /// The first view of a data set. frustum: what the whole picture shows, or the part that is free, whose middle lies
  /// at the tangent middle_x; its pose means nothing.
  geometry::Pose first_view(const geometry::Box& box_room, const geometry::Camera& frustum, double middle_x = 0) const;
  /// What the head follows.
  geometry::Trajectory trajectory(const geometry::Box& box_room, const geometry::Camera& frustum) const;
};

/// name: "orbit", "still", or a CSV file, which is read. Error: names the file and what is wrong, or says what there
/// is.
Result<HeadMovement> head_movement(const std::string& name, bool loop);

/// "x,y,z" in metres. Error: what is wrong with it, without the flag's name.
Result<glm::dvec3> parse_point(const std::string& text);

}  // namespace telesplat::viewer
