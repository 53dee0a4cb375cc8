// The display: every frame shows the cached points from where the head is now, whatever the server does (T6.5).
#pragma once

#include <string>

#include "client/viewer/display/display_surface.h"
#include "client/viewer/record/frame_spool.h"
#include "client/viewer/render/renderer.h"
#include "client/viewer/replica_worker.h"

namespace telesplat::viewer {

struct DisplayOptions {
  int width = 1280, height = 800;  ///< of a window: at first
  double fov_deg = 90, near_m = 0.02;
  double target_fps = 60;     ///< frames are paced to this; 0: as fast as possible
  int threads = 1;            ///< that the renderer's stage times are summed over
  bool detail_budget = true;  ///< lower detail where a view takes longer to construct than target_fps leaves time for
  /// The budget lowers detail no further. Fewer, larger splats save little (bench lod_detail: discs at 2560x1600 take as long at 0.7 as at
  /// 1) and cost much: along walk-around-a.csv a head had 31.3 dB with 0.5 and 32.2 to 32.8 with 0.8.
  double least_detail = 0.8;
  bool speed_detail = false;  ///< lower detail while the head moves fast (T4.4.3.1)
  double duration_s = 10;     ///< seconds from the first displayed frame; 0: until told to stop
  uint64_t frames = 0;        ///< frames to display; 0: no limit
  double hold_s = 0;          ///< the head stands still for the last so many seconds of duration_s
  splat::RenderOptions render;
  splat::SelectionOptions selection;
  float splat_scale = 0;  ///< selection.scale; 0: what suits the kernel
  image::ShadingParameters shading;
  uint64_t picture_every = 0;  ///< record every N-th frame as a picture; 0: one every 2.5 s and the last one
  uint64_t verify_every = 0;   ///< keep every N-th frame for verification; 0: none
  bool exr = false;            ///< pictures as EXR with depth too
};

/// The columns of frames.csv (docs/metrics.md).
const std::vector<std::string>& frame_columns();

struct DisplayResult {
  uint64_t frames = 0;
  bool interrupted = false;  ///< told to stop, or the person was done, before duration or frames were reached
};

/// Waits for the first complete view update (the head rests at the trajectory's beginning), then displays frames on the surface.
/// `spool` may be null: nothing is recorded.
DisplayResult run_display(const DisplayOptions& options, DisplaySurface& surface, Renderer& renderer, ModelCache& cache,
                          ReplicaWorker& worker, metrics::TableRecorder& frames, metrics::SpanRecorder& spans,
                          FrameSpool* spool);

}  // namespace telesplat::viewer
