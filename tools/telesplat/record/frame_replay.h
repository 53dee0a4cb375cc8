// Draws the displayed frames of a recorded run again, from what its viewer received. Needs no data set.
#pragma once

#include <memory>
#include <string>

#include "client/viewer/record/event_record.h"
#include "common/image/file.h"
#include "tools/telesplat/record/recorded_run.h"

namespace telesplat::launcher {

/// Rebuilds the point models of a run's displayed frames, one after the other, from its points.events.
class ModelReplay {
 public:
  /// with_summaries: as EventReplay.
  static Result<std::unique_ptr<ModelReplay>> open(const std::string& path, bool with_summaries);

  /// Advances to the model that the frame displayed. Frames come in order of display. False: the record ends before it.
  Result<bool> advance(const DisplayedFrame& frame);
  /// Null before the first frame. Valid until the next call.
  const points::PointModel* model() const { return events_->model(); }
  const points::Summaries& summaries() const { return events_->summaries(); }
  /// splat::DrawList::base of the frame.
  std::shared_ptr<const splat::BaseMesh> base() const { return events_->base(); }
  /// Number of the model's newest event. replica(): 0 for the first packer's model, 1 for the second, ...
  Sequence applied() const { return events_->applied(); }
  uint32_t replica() const { return replica_; }
  const viewer::FineRays& fine_rays() const { return events_->fine_rays(); }

 private:
  explicit ModelReplay(std::unique_ptr<viewer::EventReplay> events) : events_(std::move(events)) {}

  std::unique_ptr<viewer::EventReplay> events_;
  uint32_t replica_ = 0;
};

/// Draws displayed frames as they were displayed: by the same renderer, kernel, detail, finish and shading.
class FrameReplay {
 public:
  /// Opens the record of what the run's viewer received. renderer: "cpu" or "gl". threads: for drawing, 0: all cores.
  /// `run` must outlive this. Error: the record is missing or damaged, or this machine lacks the renderer.
  static Result<std::unique_ptr<FrameReplay>> open(const RecordedRun& run, const std::string& renderer, int threads);
  virtual ~FrameReplay() = default;

  /// Draws the frame for this camera: the frame's own, or one of another size. If the run's background is transparent,
  /// colours have the coverage in their upper byte (image/background.h). Frames come in order of display. False: the
  /// record ends before it. Errors name the file and what is wrong with it.
  virtual Result<bool> draw(const DisplayedFrame& frame, const geometry::Camera& camera, image::View& view) = 0;
  /// Draws a frame that two eyes saw.
  virtual Result<bool> draw_pair(const DisplayedFrame& frame, const viewer::EyePair& pair,
                                 std::array<image::View, 2>& views) = 0;
};

/// Returns the file that frames are made again from.
std::string record_path(const RecordedRun& run);

}  // namespace telesplat::launcher
