// Source of the display's pictures: points of the model, or frames of a volume. The display loop treats both alike.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "client/viewer/coupling/coupling.h"
#include "client/viewer/display/display_surface.h"
#include "client/viewer/hands/pick.h"
#include "common/splat/cpu_splatter.h"

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

/// Columns of frames.csv that depend on the source (docs/metrics.md).
struct DrawnFrame {
  bool empty = true;        ///< there was nothing of the scene to draw
  bool changed = true;      ///< false: the view is as FrameInput::intact found it
  bool still = false;       ///< nothing was drawn: the picture of the frame before stands
  double chosen_s = 0;      ///< monotonic clock: when the choice of what to draw was made
  splat::SplatStats stats;  ///< for volumes the warp counts as resolving
  uint64_t selected = 0, drawn = 0, items = 0, cached = 0, sequence = 0;
  uint64_t summaries = 0;  ///< summaries of bricks made so far
  double detail = 1, budget_ms = 0;
  bool halved = false;                ///< drawn at half its size (splat::RenderOptions)
  double refined = 0, refine_ms = 0;  ///< still picture: share of pixels drawn with sub-pixels; time for that
  int sub_pixels = 1;                 ///< sub-pixels of such a pixel, on each axis
  EpochId epoch;
  bool between_clips = false;  ///< it has the session's present clip, and points from an epoch before it
  ShownUpdate update;          ///< newest view update in the frame
  /// Camera of a picture that a server drew; such a picture has no depth.
  std::optional<geometry::Camera> picture_of;
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
  /// Names of what is drawn and cached, for people: "points".
  virtual const char* drawn_name() const = 0;
  virtual const char* cached_name() const = 0;
};

}  // namespace telesplat::viewer
