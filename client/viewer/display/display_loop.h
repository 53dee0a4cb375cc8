// The display: every frame shows the cached points from where the head is now, whatever the server does (T6.5).
#pragma once

#include <functional>
#include <string>

#include "client/viewer/display/view_source.h"
#include "client/viewer/record/frame_spool.h"
#include "client/viewer/viewer_worker.h"
#include "common/image/shading.h"
#include "common/splat/select/view_selection.h"

namespace telesplat::viewer {

/// Which part of a display wall this display is. Tiles are counted by rows, from the upper left.
struct WallTile {
  int columns = 1, rows = 1, tile = 0;
};

struct DisplayOptions {
  int width = 1280, height = 800;      ///< of a window: at first
  double fov_deg = 90, near_m = 0.02;  ///< the field of view is that of the whole wall
  WallTile wall;
  double target_fps = 60;     ///< frames are paced to this; 0: as fast as possible
  int threads = 1;            ///< that the renderer's stage times are summed over
  bool detail_budget = true;  ///< lower detail where a view takes longer to construct than target_fps leaves time for
  /// The budget lowers detail no further. Fewer, larger splats save little (bench lod_detail: discs at 2560x1600 take as long at 0.7 as at
  /// 1) and cost much: along walk-around-a.csv a head had 31.3 dB with 0.5 and 32.2 to 32.8 with 0.8.
  double least_detail = 0.8;
  bool speed_detail = false;  ///< lower detail while the head moves fast (T4.4.3.1)
  /// The monotonic clock when the head's movement, and the duration, begin, for several viewers that follow one head; 0: with the first displayed frame.
  double clock_from_s = 0;
  double duration_s = 10;  ///< seconds from the first displayed frame; 0: until told to stop
  uint64_t frames = 0;     ///< frames to display; 0: no limit
  double hold_s = 0;       ///< the head stands still for the last so many seconds of duration_s
  splat::RenderOptions render;
  splat::SelectionOptions selection;
  float splat_scale = 0;  ///< selection.scale; 0: what suits the kernel
  image::ShadingParameters shading;
  uint64_t picture_every = 0;  ///< record every N-th frame as a picture; 0: one every 2.5 s and the last one
  uint64_t verify_every = 0;   ///< keep every N-th frame for verification; 0: none
  bool exr = false;            ///< pictures as EXR with depth too
};

/// The camera of this display, one of a wall's tiles: its part of the off-axis frustum of the whole.
geometry::Camera tile_of(const geometry::Camera& whole, const WallTile& wall);

/// The columns of frames.csv (docs/metrics.md).
const std::vector<std::string>& frame_columns();

struct DisplayResult {
  uint64_t frames = 0;
  bool interrupted = false;  ///< told to stop, or the person was done, before duration or frames were reached
  std::string error;         ///< what made a display impossible; empty: nothing
};

/// Makes what the display draws from, once it is known what the session shows. Called in the display's thread.
using SourceMaker = std::function<Result<std::unique_ptr<ViewSource>>(SceneKind)>;

/// Waits until it is known what there is to show and for the first complete view update (the head rests at the trajectory's beginning), then displays
/// frames on the surface. Where the coupling says so each frame waits for a complete view update and shows the view of now from it; meanwhile the surface
/// is looked after ten times a second. Only the last frame, when told to stop or at the end of the duration, waits for nothing.
/// `spool` may be null: nothing is recorded.
DisplayResult run_display(const DisplayOptions& options, DisplaySurface& surface, const SourceMaker& make_source,
                          CouplingGate& gate, ReplicaWorker& worker, metrics::TableRecorder& frames,
                          metrics::SpanRecorder& spans, FrameSpool* spool);

}  // namespace telesplat::viewer
