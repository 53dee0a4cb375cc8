// Source of the display's pictures: points of the model, or frames of a volume. The display loop treats both alike.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "client/viewer/display/frame_figures.h"
#include "client/viewer/hands/pick.h"

namespace telesplat::viewer {

struct FrameInput {
  double begin_s = 0;  ///< monotonic clock
  geometry::Camera camera;
  Look look;
  bool with_depth = false;     ///< view.depth_m has room for depth, which is to be filled in
  bool with_coverage = false;  ///< the upper byte of colours over black gets the coverage (image/background.h)
  bool resting = false;        ///< before the first view update is complete: no measurements for later frames
  bool even_empty = true;      ///< draw the background if there is nothing else; else leave the view as it is
  bool intact = false;         ///< the view holds what the last call left in it
};

/// Used by one thread, the display's.
class ViewSource {
 public:
  virtual ~ViewSource() = default;
  /// If the display waits: from now on frames show this update, which is complete.
  virtual void advance(RequestId request) = 0;
  /// Draws the view of input.camera into `view`, which has its size.
  virtual DrawnFrame draw(const FrameInput& input, image::View& view) = 0;
  /// Draws both eyes' pictures from one choice. input.camera stands between them (eyes/eye_rig.h). Targets have room
  /// for depth if input asks for it; their rows follow each other unless draws_into_parts().
  virtual DrawnFrame draw_pair(const FrameInput& input, const std::array<geometry::Camera, 2>& eyes,
                               const std::array<splat::FrameTarget, 2>& targets) = 0;
  /// True if it can draw pairs into parts of pictures, without coverage.
  virtual bool draws_into_parts() const { return false; }
  /// Returns the content at a pixel of this camera's view. opacity, for volumes: the place found, with all in front of
  /// it, hides this share of what lies behind. Nothing: the pixel is empty.
  virtual std::optional<Pick> pick(const geometry::Camera& camera, double x_pix, double y_pix, double opacity) = 0;
  /// The frame has been displayed.
  virtual void displayed() {}
  virtual DrawnUnits units() const { return {}; }
};

}  // namespace telesplat::viewer
