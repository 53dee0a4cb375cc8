// A person's hold on the camera: orbit, pan, dolly and flight, in room space, without any window system.
#pragma once

#include <optional>

#include "common/geometry/trajectory.h"

namespace telesplat::viewer {

/// Inputs move a goal; the camera follows it with a short exponential lag that does not depend on the frame rate.
/// Distances on the screen are in window heights, +x right, +y down. Everything a person does leaves the pose within
/// Limits; numbers that are not finite are ignored. One thread.
class CameraControls {
 public:
  /// In units of the data set's largest extent, which itself is taken to be within metres that cameras can have
  /// (geometry::validate).
  struct Limits {
    static constexpr double kSmallest_m = 1e-4, kLargest_m = 1e4;
    static constexpr double kNearest = 0.03, kFarthest = 10;  ///< eye to pivot; twice home's distance if that is more
    static constexpr double kPivot = 2;                       ///< pivot to centre, along each axis; or as far as home's
    static constexpr double kFlight = 10;                     ///< eye to centre in flight, along each axis; or as above
    static constexpr double kSlowest = 0.02, kFastest = 5;    ///< flight, extents a second
    static constexpr double kPitch_rad = 90 * 3.14159265358979 / 180;  ///< up and down
  };
  /// home: where reset() leads to, around a data set of 0.8 m at the origin, as long as nothing else is told.
  explicit CameraControls(const geometry::Pose& home = geometry::default_pose());

  /// Where the camera is and what it turns about: eye = anchor + rotation * (-middle_x * distance, 0, distance).
  /// rotation = yaw about y, then pitch about x, then roll about z. So the anchor is seen at the tangent middle_x.
  struct View {
    glm::dvec3 anchor{0.0};
    double yaw = 0, pitch = 0, roll = 0, distance = 1, middle_x = 0;
  };

  /// The data set's box, which limits and speeds follow, and its home, from which the centre is seen at the tangent
  /// middle_x. The camera goes there if nobody has moved it since it was there. A box that no camera can show changes
  /// nothing.
  void set_scene(const geometry::Box& box_room, const geometry::Pose& home, double middle_x = 0);

  /// Around the pivot (the data set's centre until panned), half a turn a window height; what is seen follows the
  /// pointer, however the head is tilted. In flight: looks around.
  void orbit(double dx, double dy);
  /// Moves the pivot with the pointer; height_tangent: what the window shows, top to bottom, at distance 1.
  void pan(double dx, double dy, double height_tangent);
  /// To (> 0) or from the pivot, a tenth a step. In flight: faster or slower.
  void wheel(double steps);
  /// Upwards to, downwards from the pivot: a window height is 30 steps of the wheel. Not in flight.
  void dolly(double dy);
  /// Tilts the head: half a turn a window height.
  void roll(double dx);
  /// The place, in the room, comes to the middle and is what the camera turns about. Leaves flight.
  void centre_on(const glm::dvec3& place_room);

  /// In flight the camera turns about itself; leaving it, about the point ahead that lies on the data set's vertical
  /// axis, or that is as far as its centre. The view does not change with either.
  void set_flying(bool flying);
  bool flying() const { return flying_; }
  /// Where to fly while the keys are held, -1 to 1 each: right and forward of the camera, up of the room.
  struct Flight {
    double right = 0, up = 0, forward = 0;
    bool fast = false;
  };
  void fly(const Flight& flight) { flight_ = flight; }

  /// Home, orbiting, on the shortest way.
  void reset();
  /// Goes on from this pose, at once; a head that is tilted to the side straightens up, unless it is to stay tilted.
  void take_over(const geometry::Pose& pose, bool tilted = false);
  /// Where a person's inputs lead; from flight, where leaving it would.
  View view() const;
  /// Goes to a pose, or to where it was once, on the shortest way. Leaves flight.
  void travel(const geometry::Pose& pose);
  void travel(const View& view);

  /// `dt_s` later (at most 0.25 s count). The camera of that moment.
  geometry::Pose advance(double dt_s);
  geometry::Pose pose() const { return pose_of(now_); }

 private:
  static glm::dquat rotation(const View& s);
  static geometry::Pose pose_of(const View& s);
  static View view_at(const geometry::Pose& pose, double distance, double middle_x);
  /// Along the ray through middle_x: who looks at the data set's vertical axis turns about that.
  std::optional<double> distance_to_axis(const geometry::Pose& pose, double middle_x) const;
  double distance_of_interest(const geometry::Pose& pose, double middle_x) const;
  double middle_of(const geometry::Pose& pose) const;
  View home_view() const;
  glm::dvec3 flight_velocity() const;
  void clamp_goal();

  geometry::Pose home_;
  double home_middle_x_ = 0;
  glm::dvec3 centre_{0.0};               // of the data set
  double extent_m_ = 0.8;                // its largest one
  double farthest_m_ = 8;                // eye to pivot
  double pivot_m_ = 1.6, flight_m_ = 8;  // pivot to centre, eye to centre in flight
  double speed_ = 0.5;                   // extents a second
  View now_, goal_;
  Flight flight_;
  bool flying_ = false, touched_ = false, has_scene_ = false;
};

}  // namespace telesplat::viewer
