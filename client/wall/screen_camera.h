// Computes the camera of an eye that looks at a screen of a wall: off-axis, with the screen as picture plane.
#pragma once

#include <vector>

#include "client/wall/wall.h"

namespace telesplat::wall {

/// Least distance of an eye from a screen's plane, metres: a nearer eye, or one behind the plane, is moved to this
/// distance, so that there is always a picture.
inline constexpr double kNearestEye_m = 0.05;

/// Returns the pose of the wall's axes in the room while the head is there.
geometry::Pose wall_in_room(const Wall& wall, const geometry::Pose& head_room);

/// Returns the camera of a screen for one eye, which may be any point of the room: the head for a mono display, one of
/// two eyes for a stereo display.
geometry::Camera screen_camera(const Screen& screen, const geometry::Pose& wall_in_room, const glm::dvec3& eye_room,
                               double near_m);
/// The same for the head itself. Precondition: the wall has such a screen.
geometry::Camera screen_camera(const Wall& wall, int screen, const geometry::Pose& head_room, double near_m);

/// Returns where the eye sees a point of the room on the screen's plane: metres to the right and up from the middle of
/// its picture. Nothing: the point is not in front of the eye as it looks at the screen.
std::optional<glm::dvec2> seen_at(const Screen& screen, const geometry::Pose& wall_in_room, const glm::dvec3& eye_room,
                                  const glm::dvec3& point_room);

/// Returns one camera at the head, with the wall's axes, for all that the wall shows: it covers a plane wall to its
/// edges, other walls up to 50 degrees to each side. Data are fitted into it. Its pixels are as fine as the screens'.
geometry::Camera fitting_frustum(const Wall& wall, double near_m);

/// Returns the largest scale about the room's origin, at most 1, at which each corner of the box is on a screen; bezels
/// count as screen.
double shown_share(const Wall& wall, const geometry::Pose& head_room, const geometry::Box& box_room);

/// True if all screens lie in one plane and have its axes.
bool is_plane(const Wall& wall);

/// A wall laid flat: one picture that holds the picture of each screen, with gaps where bezels are.
struct Unrolled {
  int width = 0, height = 0;           ///< pixels of the whole
  std::vector<geometry::Rect> places;  ///< place of each screen's picture, in the order of Wall::screens
  double metres_per_pixel = 0;
};

/// Pixels are as fine as the finest screen's. A screen with coarser pixels gets a place of more pixels than its
/// picture. Error: the whole is larger than a picture may be; names the wall, its size and the limit.
Result<Unrolled> unrolled(const Wall& wall);

}  // namespace telesplat::wall
