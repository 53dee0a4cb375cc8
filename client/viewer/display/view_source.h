// What the display draws: points of the model, or frames of a volume. The display loop does not know which.
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
  bool with_depth = false;     ///< view.depth_m has room for it and is to be filled
  bool with_coverage = false;  ///< colours over black get the coverage into their upper byte (image/background.h)
  bool resting = false;  ///< before the first view update is complete: nothing is measured for the sake of later frames
  bool even_empty = true;  ///< draw the background too if there is nothing else; else leave the view as it is
  bool intact = false;     ///< the view holds what the call before this one left in it
};

/// The columns of frames.csv that depend on what is drawn (docs/metrics.md).
struct DrawnFrame {
  bool empty = true;        ///< there was nothing of the scene to draw
  bool changed = true;      ///< false: the view is as FrameInput::intact found it
  bool still = false;       ///< nothing was drawn: the picture of the frame before stands
  double chosen_s = 0;      ///< monotonic clock: what to draw was chosen
  splat::SplatStats stats;  ///< of volumes the warp is the resolving
  uint64_t selected = 0, drawn = 0, items = 0, cached = 0, sequence = 0;
  uint64_t summaries = 0;  ///< of bricks, that had been made by then
  double detail = 1, budget_ms = 0;
  bool halved = false;                ///< drawn at half its size (splat::RenderOptions)
  double refined = 0, refine_ms = 0;  ///< of a still picture: share of pixels drawn with sub-pixels; time for that
  int sub_pixels = 1;                 ///< of such a pixel, on each axis
  EpochId epoch;
  bool between_clips = false;  ///< it is cut as the session is now, and its points are of an epoch before that
  ShownUpdate update;          ///< the newest view update that it shows
  /// The view that a picture of a server shows; such a picture has no depth.
  std::optional<geometry::Camera> picture_of;
};

/// Used by one thread, the display's.
class ViewSource {
 public:
  virtual ~ViewSource() = default;
  /// Where the display waits: from now on frames show this update, which is complete.
  virtual void advance(RequestId request) = 0;
  /// Draws the view of input.camera, into `view`, which has its size.
  virtual DrawnFrame draw(const FrameInput& input, image::View& view) = 0;
  /// Draws what both eyes see, of one choice. input.camera stands between them (eyes/eye_rig.h). Targets have room for
  /// depth where input asks for it; their rows follow each other unless draws_into_parts().
  virtual DrawnFrame draw_pair(const FrameInput& input, const std::array<geometry::Camera, 2>& eyes,
                               const std::array<splat::FrameTarget, 2>& targets) = 0;
  /// Whether it can draw pairs into parts of pictures, without coverage.
  virtual bool draws_into_parts() const { return false; }
  /// What lies at a pixel of the view of this camera; opacity: how much of what lies behind the place must be hidden by
  /// it and what is in front of it, of volumes. Nothing: there is nothing.
  virtual std::optional<Pick> pick(const geometry::Camera& camera, double x_pix, double y_pix, double opacity) = 0;
  /// The frame has been displayed.
  virtual void displayed() {}
  /// What is drawn and cached, for people: "points".
  virtual const char* drawn_name() const = 0;
  virtual const char* cached_name() const = 0;
};

}  // namespace telesplat::viewer
