// Computes the eyes of a head, the view to sample for them, and one picture from theirs. No clocks, no OpenGL.
#pragma once

#include <array>
#include <cmath>
#include <memory>

#include "client/stereo/autostereo/interleaver.h"
#include "client/viewer/display/eyes/stereo_options.h"
#include "common/geometry/box.h"
#include "common/geometry/camera.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// Cameras of a frame that two eyes see.
struct EyePair {
  geometry::Camera head;                 ///< stands between the eyes, with their orientation
  std::array<geometry::Camera, 2> eyes;  ///< left, right: all three have one size and pixels of one size
  double screen_m = 0;                   ///< distance of the screen before the head's place
};

/// True if both eyes look the same way with pixels of one size, so that one choice of points serves both.
inline bool alike(const std::array<geometry::Camera, 2>& eyes) {
  constexpr double kParallel = 1e-6, kSameFocal = 1e-4;
  const double turned = std::abs(glm::dot(eyes[0].pose.orientation, eyes[1].pose.orientation));
  return 1 - turned < kParallel && eyes[0].width == eyes[1].width && eyes[0].height == eyes[1].height &&
         std::abs(eyes[0].focal_x() / eyes[1].focal_x() - 1) < kSameFocal;
}

/// Returns a camera between two eyes that look the same way; it looks as they do.
inline geometry::Camera between(const std::array<geometry::Camera, 2>& eyes) {
  geometry::Camera out = eyes[0];
  out.pose.position_room = 0.5 * (eyes[0].pose.position_room + eyes[1].pose.position_room);
  return out;
}

class EyeRig {
 public:
  explicit EyeRig(const StereoOptions& options);

  bool on() const { return options_.on(); }
  const StereoOptions& options() const { return options_; }

  /// Returns the eyes of a frame. head: the display's camera, with the size of one eye's picture. turned: the head's
  /// orientation, which its eyes follow. t_s: time on the tracked head's movement. scene_room: the scene; if the screen
  /// is to stand at its middle's distance, the first box that is not empty counts, once `t_s` is not negative any more.
  EyePair eyes(const geometry::Camera& head, const glm::dquat& turned, double t_s, const geometry::Box& scene_room);
  EyePair eyes(const geometry::Camera& head, double t_s, const geometry::Box& scene_room) {
    return eyes(head, head.pose.orientation, t_s, scene_room);
  }
  /// Returns the view to ask samplers for: from the middle, with all that either eye sees of the scene.
  static geometry::Camera sampled(const EyePair& pair, const geometry::Box& scene_room);

  /// Makes one picture for the display, with depth if the views have it and the mode allows it. Precondition: on().
  void compose(const EyePair& pair, const std::array<image::View, 2>& views, bool with_depth, image::View& out);
  /// Size of that picture, for eyes' pictures of this size.
  stereo::Size composed_size(int width, int height) const;
  /// Draws the pattern into both pictures, whose size is set. False: no pattern is chosen.
  bool draw_pattern(std::array<image::View, 2>& views) const;

  /// Reads the panel's file again, as a person may have changed it; the display's pixels stay as they are. Error: what
  /// is wrong with it; the panel stays as it was.
  Status read_panel_again();

 private:
  double screen_distance(const geometry::Camera& head, double t_s, const geometry::Box& scene_room);

  StereoOptions options_;
  double screen_m_ = 0;  // 0: not settled yet
  std::unique_ptr<stereo::Interleaver> interleaver_;
};

/// Returns the eyes of a recorded frame, from their places and the screen's distance before the head.
EyePair recorded_eyes(const StereoOptions& options, const geometry::Camera& head, double screen_m,
                      const std::array<glm::dvec3, 2>& places_room);

}  // namespace telesplat::viewer
