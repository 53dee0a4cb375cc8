// Makes both eyes' pictures of a frame: draws them from one choice, composes them, keeps them for verification.
#pragma once

#include <array>

#include "client/viewer/display/display_options.h"
#include "client/viewer/display/eyes/eye_rig.h"
#include "client/viewer/display/view_source.h"
#include "client/viewer/record/frame_spool.h"

namespace telesplat::viewer {

/// Used by one thread, the display's.
class EyePictures {
 public:
  explicit EyePictures(const StereoOptions& options) : rig_(options), mode_(options.mode) {}

  stereo::Mode mode() const { return mode_; }
  bool on() const { return rig_.on(); }
  /// Sets the eyes of the frame that begins; returns the camera to ask samplers for. turned: the head's orientation,
  /// which a wall's screens need not have. Precondition of this and sampled(): on().
  geometry::Camera begin(double now_s, const geometry::Camera& head, const glm::dquat& turned, double t_s,
                         const geometry::Box& scene_room);
  /// Returns the camera to ask samplers for, for a head that is to be there.
  geometry::Camera sampled(const geometry::Camera& head, const glm::dquat& turned, double t_s,
                           const geometry::Box& scene_room);
  const EyePair& pair() const { return pair_; }

  /// Draws both and composes them into `view`, which gets the display's size. input: for the head's camera. spooled:
  /// frames may be kept, so room for depth is made at once. Precondition: begin().
  DrawnFrame draw(ViewSource& source, FrameInput input, bool spooled, image::View& view);
  /// The view at a place of the display: a camera, and a pixel of its picture. If both eyes' pictures are interleaved,
  /// it is the head's camera.
  struct Aim {
    geometry::Camera camera;
    glm::dvec2 at_pix;
  };
  /// head: the display's camera. pair: eyes of the frame on display. share: of the display's width and height, from its
  /// upper left corner.
  Aim aim(const geometry::Camera& head, const EyePair& pair, const glm::dvec2& share) const;
  /// Returns the display's camera with the display's pixels; with quad buffers those of one eye's picture, since each
  /// picture fills the display.
  geometry::Camera display(const geometry::Camera& head) const;
  /// Keeps both pictures for verification.
  void keep(FrameSpool& spool, const SpooledFrame& frame);

 private:
  void follow_panel_file(double now_s);
  std::array<splat::FrameTarget, 2> parts_of(image::View& view) const;

  EyeRig rig_;
  stereo::Mode mode_;
  EyePair pair_;
  std::array<image::View, 2> views_;
  double looked_s_ = -1e9;  // when the panel's file was last looked at
  int64_t panel_time_ = 0;  // when that file was written
  bool panel_changed_ = false;
};

}  // namespace telesplat::viewer
