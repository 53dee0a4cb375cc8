// What a screen of a wall shows an eye: an off-axis camera whose picture plane is the screen.
#pragma once

#include <vector>

#include "client/wall/wall.h"

namespace telesplat::wall {

/// An eye is taken for no nearer to a screen's plane than this, metres, and one behind it for so far before it: its
/// picture stays one.
inline constexpr double kNearestEye_m = 0.05;

/// Where the wall's axes are in the room while the head is there.
geometry::Pose wall_in_room(const Wall& wall, const geometry::Pose& head_room);

/// The camera of a screen for one eye, which may be any point of the room: of a mono display the head, of a stereo
/// display one of two.
geometry::Camera screen_camera(const Screen& screen, const geometry::Pose& wall_in_room, const glm::dvec3& eye_room,
                               double near_m);
/// The same for the head itself. Precondition: the wall has such a screen.
geometry::Camera screen_camera(const Wall& wall, int screen, const geometry::Pose& head_room, double near_m);

/// Where on a screen a point of the room is seen from the eye: metres from the middle of its picture, to the right and
/// up. Nothing: the point is not in front of the eye as it looks at the screen.
std::optional<glm::dvec2> seen_at(const Screen& screen, const geometry::Pose& wall_in_room, const glm::dvec3& eye_room,
                                  const glm::dvec3& point_room);

/// What the whole wall shows of what lies in front, as one camera at the head with the wall's axes: for a plane wall
/// its edges, for others 100 degrees across at most. Data are fitted into it. Its pixels are as fine as the screens'.
geometry::Camera fitting_frustum(const Wall& wall, double near_m);

/// At what share of its size about the room's origin all corners of the box are on some screen, bezels counted in; 1:
/// they are as it stands.
double shown_share(const Wall& wall, const geometry::Pose& head_room, const geometry::Box& box_room);

/// All screens lie in one plane, and have its axes.
bool is_plane(const Wall& wall);

/// A wall laid flat: where the picture of each screen lies in one picture of all, with the gaps that bezels leave.
struct Unrolled {
  int width = 0, height = 0;           ///< pixels of the whole
  std::vector<geometry::Rect> places;  ///< of each screen's picture
  double metres_per_pixel = 0;
};

/// Pixels are as fine as the finest screen's. Screens of other pixels have places of other sizes than their pictures.
/// Error: the whole is larger than a picture may be; names the wall, its size and the limit.
Result<Unrolled> unrolled(const Wall& wall);

}  // namespace telesplat::wall
