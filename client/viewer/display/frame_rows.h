// Records displayed frames: rows of frames.csv, spans of the trace, pictures.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "client/viewer/display/display_options.h"
#include "client/viewer/display/frame_table.h"
#include "client/viewer/record/frame_spool.h"
#include "common/metrics/recorder.h"

namespace telesplat::viewer {

/// Used by one thread, the display's.
class FrameRows {
 public:
  /// wall: the display is one of several, and a frame's row waits for the next frame, which brings when the other
  /// displays presented it.
  FrameRows(metrics::TableRecorder& frames, metrics::SpanRecorder& spans, bool wall)
      : frames_(frames), spans_(spans), wall_(wall) {}

  /// to_master_s: from the monotonic clock to the master's.
  void add(const MeasuredFrame& frame, double to_master_s);
  /// skew_s: from the first of the wall's displays that presented this frame to the last.
  void note_skew(uint64_t wall_frame, double skew_s);
  /// Adds the row that waits.
  void flush();

 private:
  metrics::TableRecorder& frames_;
  metrics::SpanRecorder& spans_;
  const bool wall_;
  std::optional<MeasuredFrame> row_;
};

/// Chooses the frames that are kept as pictures or for verification. Used by one thread, the display's.
class KeptFrames {
 public:
  /// Both must outlive it. spool: DisplayParts::spool.
  KeptFrames(const DisplayOptions& options, const std::function<FrameSpool*()>& spool) : o_(options), find_(spool) {}
  /// Call it once the session is known.
  void open() { spool_ = find_ ? find_() : nullptr; }
  /// Null: no frame is kept.
  FrameSpool* spool() const { return spool_; }

  /// FrameUse of this frame; last: the display ends with it.
  uint32_t use_of(uint64_t number, double t_s, bool last) const;
  /// A frame that is kept as a picture: the next one is due a period later.
  void on_picture(double t_s);

 private:
  const DisplayOptions& o_;
  const std::function<FrameSpool*()>& find_;
  FrameSpool* spool_ = nullptr;
  double next_picture_s_ = 0;
};

/// The moments of a display's frames, monotonic clock. Used by one thread, the display's.
class FrameClock {
 public:
  bool started() const { return start_s_ > 0; }
  void start(double at_s) { start_s_ = at_s; }
  double start_s() const { return start_s_; }
  /// The end of the frame before; 0: this is the first.
  double previous_s() const { return previous_s_; }
  /// When the frame before the last one was seen.
  double seen_before_s() const { return seen_before_s_; }
  /// The frame is seen now, and replaces what stood for `refresh_s` or longer.
  void seen(MeasuredFrame& frame, double now_s, double refresh_s);
  void ended(const MeasuredFrame& frame) { previous_s_ = frame.end_s; }
  /// When the frame after one that began at begin_s is due. Frames are due at equal distances: one that began late,
  /// because sleep ended late, does not delay those after it.
  double next_s(double begin_s, double target_fps);

 private:
  double start_s_ = 0, previous_s_ = 0, seen_s_ = 0, seen_before_s_ = 0, due_s_ = 0;
};

}  // namespace telesplat::viewer
