// A person's control of the camera: orbit, pan, dolly and flight, in room space, without any window system.
#pragma once

#include <optional>

#include "common/geometry/trajectory.h"

namespace telesplat::viewer {

/// Inputs move a goal; the camera follows it with a short exponential lag that does not depend on the frame rate.
/// Distances on the screen are in window heights, +x right, +y down. No input can move the pose beyond Limits; numbers
/// that are not finite are ignored. Used by one thread.
class CameraControls {
 public:
  /// In units of the data set's largest extent, which itself is limited to metres that cameras can have
  /// (geometry::validate).
  struct Limits {
    static constexpr double kSmallest_m = 1e-4, kLargest_m = 1e4;
    static constexpr double kNearest = 0.03, kFarthest = 10;  ///< eye to pivot; twice home's distance if that is more
    static constexpr double kPivot = 2;    ///< pivot to centre, along each axis; home's if that is more
    static constexpr double kFlight = 10;  ///< eye to centre in flight, along each axis; or as for kFarthest
    static constexpr double kSlowest = 0.02, kFastest = 5;             ///< flight, extents a second
    static constexpr double kPitch_rad = 90 * 3.14159265358979 / 180;  ///< up and down
  };
  /// home: pose of reset(), around a data set of 0.8 m at the origin, until set_scene() is called.
  explicit CameraControls(const geometry::Pose& home = geometry::default_pose());

  /// The camera's place, and the anchor that it turns about: eye = anchor + rotation * (-middle_x * distance, 0,
  /// distance). rotation = yaw about y, pitch about x, then roll about z. The anchor is seen at the tangent middle_x.
  struct View {
    glm::dvec3 anchor{0.0};
    double yaw = 0, pitch = 0, roll = 0, distance = 1, middle_x = 0;
  };

  /// Sets the data set's box, which limits and speeds follow, and its home, which shows the centre at the tangent
  /// middle_x. The camera goes there if the person has not moved it since it was at home. A box that no camera can show
  /// changes nothing.
  void set_scene(const geometry::Box& box_room, const geometry::Pose& home, double middle_x = 0);

  /// Turns around the pivot (the data set's centre until panned), half a turn for each window height; the picture
  /// follows the pointer, however the head is tilted. In flight: looks around.
  void orbit(double dx, double dy);
  /// Moves the pivot with the pointer; height_tangent: height of the window's view at distance 1.
  void pan(double dx, double dy, double height_tangent);
  /// Moves towards the pivot (> 0) or away from it, a tenth of the distance a step. In flight: changes the speed.
  void wheel(double steps);
  /// Moves to the pivot (upwards) or away (downwards): a window height is 30 steps of the wheel. Not in flight.
  void dolly(double dy);
  /// Tilts the head: half a turn for each window height.
  void roll(double dx);
  /// Brings this place of the room to the middle; the camera then turns about it. Leaves flight.
  void centre_on(const glm::dvec3& place_room);

  /// In flight the camera turns about itself; after flight, about the point ahead that lies on the data set's vertical
  /// axis, or is as far away as its centre. Neither changes the view.
  void set_flying(bool flying);
  bool flying() const { return flying_; }
  /// Directions of flight while keys are held, -1 to 1 each: right and forward of the camera, up of the room.
  struct Flight {
    double right = 0, up = 0, forward = 0;
    bool fast = false;
  };
  void fly(const Flight& flight) { flight_ = flight; }

  /// Returns home and to orbiting, on the shortest way.
  void reset();
  /// Goes on from this pose, at once; a head that is tilted to the side straightens up, unless `tilted` is set.
  void take_over(const geometry::Pose& pose, bool tilted = false);
  /// The view to which the person's inputs lead; in flight, the view that follows when flight ends.
  View view() const;
  /// Goes to a pose or an earlier view, on the shortest way. Leaves flight.
  void travel(const geometry::Pose& pose);
  void travel(const View& view);

  /// Advances by `dt_s` (at most 0.25 s count), and returns the camera's pose.
  geometry::Pose advance(double dt_s);
  geometry::Pose pose() const { return pose_of(now_); }

 private:
  static glm::dquat rotation(const View& s);
  static geometry::Pose pose_of(const View& s);
  static View view_at(const geometry::Pose& pose, double distance, double middle_x);
  /// Distance along the ray through middle_x to the data set's vertical axis: a camera that looks at it turns about it.
  std::optional<double> distance_to_axis(const geometry::Pose& pose, double middle_x) const;
  double distance_of_interest(const geometry::Pose& pose, double middle_x) const;
  double middle_of(const geometry::Pose& pose) const;
  View home_view() const;
  glm::dvec3 flight_velocity() const;
  void clamp_goal();

  geometry::Pose home_;
  double home_middle_x_ = 0;
  glm::dvec3 centre_{0.0};               // centre of the data set
  double extent_m_ = 0.8;                // its largest extent
  double farthest_m_ = 8;                // eye to pivot
  double pivot_m_ = 1.6, flight_m_ = 8;  // pivot to centre, eye to centre in flight
  double speed_ = 0.5;                   // extents a second
  View now_, goal_;
  Flight flight_;
  bool flying_ = false, touched_ = false, has_scene_ = false;
};

}  // namespace telesplat::viewer
