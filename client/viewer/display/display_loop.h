// Runs the display: every frame shows the cached scene from where the head is now, even if the server is late (T6.5).
#pragma once

#include <functional>
#include <string>

#include "client/viewer/display/display_options.h"
#include "client/viewer/display/frame_table.h"
#include "client/viewer/display/view_source.h"
#include "client/viewer/record/frame_spool.h"
#include "client/viewer/viewer_worker.h"
#include "client/viewer/wall_pace.h"

namespace telesplat::viewer {

struct DisplayResult {
  uint64_t frames = 0;
  bool interrupted = false;  ///< a stop was requested, or the person was done, before duration or frames were reached
  std::string error;         ///< reason why nothing could be displayed; empty: no error
};

/// Makes the source that the display draws. Called in the display's thread: when the session's scene is known, and
/// again when the session goes on with one that is drawn another way; the source before it is destroyed by then.
/// pictures_a_second: DisplaySurface::pictures_a_second().
using SourceMaker = std::function<Result<std::unique_ptr<ViewSource>>(Received&, double pictures_a_second)>;

/// Parts of a display. All must outlive it.
struct DisplayParts {
  const DisplayOptions& options;
  DisplaySurface& surface;
  const SourceMaker& make_source;
  CouplingGate& gate;
  ViewerWorker& worker;
  metrics::TableRecorder& frames;
  metrics::SpanRecorder& spans;
  /// Asked once the session is known. It, or what it returns, may be null: nothing is recorded.
  const std::function<FrameSpool*()>& spool;
  /// The display is one of several that present their frames together, from one head; null: it is by itself.
  WallPace* wall = nullptr;
};

/// Waits until it is known what there is to show and for the first complete view update (the head rests at the
/// trajectory's beginning), then displays frames on the surface. Where the coupling says so each frame waits for a
/// complete view update and shows the view of now from it; meanwhile the surface is looked after ten times a second,
/// and after options.most_wait_s frames are drawn from what is there (docs/coupling.md). The coupling may change at any
/// time.
/// Only the last frame, when told to stop or at the end of the duration, waits for nothing.
DisplayResult run_display(const DisplayParts& parts);

}  // namespace telesplat::viewer
