// Options of a display that are set before it begins: its size, its pace, how it draws and what it keeps.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>

#include "client/viewer/coupling/coupling.h"
#include "client/viewer/display/eyes/stereo_options.h"
#include "client/viewer/display/wall.h"
#include "client/viewer/record/record_options.h"
#include "common/image/shading.h"
#include "common/splat/render_options.h"
#include "common/splat/select/view_selection.h"

namespace telesplat::viewer {

/// Options of a headset's display that are set before it begins.
struct XrOptions {
  /// Place of the room's origin, around which the data set stands, in the headset's space: metres, +y up. Nothing: a
  /// place that suits that space.
  std::optional<glm::dvec3> origin_m;
  double scale = 1;   ///< pixels drawn for each pixel that the runtime recommends, on each axis
  bool depth = true;  ///< submit depth, if the runtime takes it
};

/// Lower detail than the data have, for frames in time.
struct DetailOptions {
  bool by_budget = true;  ///< lower detail if a view takes longer to construct than target_fps allows
  /// Lower limit of the budget's detail. Fewer, larger splats save little (bench lod_detail: discs at 2560x1600 take as
  /// long at 0.7 as at 1) and cost much: along walk-around-a.csv a head had 31.3 dB with 0.5 and 32.2 to 32.8 with 0.8.
  double least = 0.8;
  bool by_speed = false;  ///< lower detail while the head moves fast (T4.4.3.1)
};

/// Start and length of a display.
struct DisplaySpan {
  /// Time on the monotonic clock at which the head's movement and the duration begin, for several viewers that follow
  /// one head; 0: with the first displayed frame.
  double clock_from_s = 0;
  double duration_s = 10;  ///< seconds from the first displayed frame; 0: until a stop is requested
  uint64_t frames = 0;     ///< frames to display; 0: no limit
  double hold_s = 0;       ///< the head stands still this long at the end of duration_s

  /// Time that the head has moved, t_s after the first displayed frame; before that t_s is negative.
  double moved_s(double t_s) const {
    return duration_s > 0 ? std::min(std::max(0.0, t_s), duration_s - hold_s) : std::max(0.0, t_s);
  }
  bool moves(double t_s) const { return t_s >= 0 && (duration_s <= 0 || t_s < duration_s - hold_s); }
  bool over(double t_s) const { return duration_s > 0 && t_s >= duration_s; }
};

struct DisplayOptions {
  int width = 1280, height = 800;      ///< a window's first size
  double fov_deg = 90, near_m = 0.02;  ///< the field of view covers the whole wall
  WallTile wall;
  StereoOptions stereo;    ///< two eyes; the field of view is that of each eye's picture
  double target_fps = 60;  ///< frames are paced to this; 0: as fast as possible
  DetailOptions detail;
  DisplaySpan span;
  /// If the display waits for view updates: seconds without any sign of one until frames are drawn from what is there.
  double most_wait_s = StallWatch::kMost_s;
  /// Samples a pixel of a still picture: 4 or 16; 1: it is drawn as all others are. Used only if pictures are
  /// antialiased and not transparent.
  int still_samples = 16;
  splat::RenderOptions render;
  splat::SelectionOptions selection;
  float splat_scale = 0;  ///< selection.scale; 0: that which suits the kernel
  image::ShadingParameters shading;
  bool legend = true;        ///< pictures and the window show what colours mean, if the session says so
  bool transparent = false;  ///< pictures have the coverage as alpha; shading.background is black then
  KeptOptions kept;
};

}  // namespace telesplat::viewer
