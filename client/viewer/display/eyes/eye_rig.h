// Where the eyes of a head are, what is to be sampled for them, and one picture made of theirs. No clocks, no OpenGL.
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

/// The cameras of a frame that two eyes see.
struct EyePair {
  geometry::Camera head;                 ///< stands between the eyes, with their orientation
  std::array<geometry::Camera, 2> eyes;  ///< left, right: all three have one size and pixels of one size
  double screen_m = 0;                   ///< how far the screen is before the head's place
};

/// Whether both eyes look the same way with pixels of one size, so that one choice of points serves both.
inline bool alike(const std::array<geometry::Camera, 2>& eyes) {
  constexpr double kParallel = 1e-6, kSameFocal = 1e-4;
  const double turned = std::abs(glm::dot(eyes[0].pose.orientation, eyes[1].pose.orientation));
  return 1 - turned < kParallel && eyes[0].width == eyes[1].width && eyes[0].height == eyes[1].height &&
         std::abs(eyes[0].focal_x() / eyes[1].focal_x() - 1) < kSameFocal;
}

/// Stands between two eyes that look the same way, and looks as they do.
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

  /// The eyes of a frame. head: the display's camera, of the size of one eye's picture. turned: of the head, whose eyes
  /// lie beside each other. t_s: of the tracked head's movement. scene_room: what is shown; where the screen is to be
  /// as far as its middle, the first box that is not empty counts, once `t_s` is not negative any more.
  EyePair eyes(const geometry::Camera& head, const glm::dquat& turned, double t_s, const geometry::Box& scene_room);
  EyePair eyes(const geometry::Camera& head, double t_s, const geometry::Box& scene_room) {
    return eyes(head, head.pose.orientation, t_s, scene_room);
  }
  /// What is to be asked of the samplers: a view from the middle that has what either eye sees of the scene.
  static geometry::Camera sampled(const EyePair& pair, const geometry::Box& scene_room);

  /// One picture for the display, with depth if the views' holds and the mode has any. Precondition: on().
  void compose(const EyePair& pair, const std::array<image::View, 2>& views, bool with_depth, image::View& out);
  /// Its size, of eyes' pictures of this size.
  stereo::Size composed_size(int width, int height) const;
  /// Draws the pattern into both pictures, whose size is set. False: there is none.
  bool draw_pattern(std::array<image::View, 2>& views) const;

  /// Reads the panel's file again, as somebody may have changed it; pixels of the display stay as they are. Error: what
  /// is wrong with it; the panel stays as it was.
  Status read_panel_again();

 private:
  double screen_distance(const geometry::Camera& head, double t_s, const geometry::Box& scene_room);

  StereoOptions options_;
  double screen_m_ = 0;  // 0: not settled yet
  std::unique_ptr<stereo::Interleaver> interleaver_;
};

/// The eyes of a frame that was recorded: where they were, and how far the screen was before the head.
EyePair recorded_eyes(const StereoOptions& options, const geometry::Camera& head, double screen_m,
                      const std::array<glm::dvec3, 2>& places_room);

}  // namespace telesplat::viewer
