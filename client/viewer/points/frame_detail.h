// Chooses how frames of points are drawn: their detail and size, from the time that earlier ones took, and whether a
// camera stands still, so that its picture can be refined.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "client/viewer/coupling/frame_budget.h"
#include "client/viewer/display/display_options.h"
#include "client/viewer/display/view_source.h"
#include "client/viewer/render/renderer.h"

namespace telesplat::viewer {

/// Used by one thread, the display's.
class FrameDetail {
 public:
  /// target_fps: 0: frames have all the time they need.
  FrameDetail(const DetailOptions& options, double target_fps);

  /// Returns the detail for the frame that begins. distance_m: distance of typical content; 0: not known.
  double wanted(const FrameInput& input, double distance_m);
  /// True if frames are drawn at half their size.
  bool halves() const { return half_size_.on(); }
  double budget_ms() const { return budget_.budget_ms(); }
  /// A frame of list.points was drawn with this detail. It measures the cost of this frame alone: a core that samplers
  /// held for a while is no reason for a coarser picture.
  void measure(const FrameInput& input, double detail, const DrawnFrame& drawn, const splat::DrawList& list,
               const Renderer& renderer);

 private:
  DetailOptions options_;
  FrameBudget budget_;
  HalfSize half_size_;
  SpeedDetail speed_;
};

/// Counts the frames for which the camera, or a pair of cameras, the look and the clips have been the same.
class StillHead {
 public:
  /// Begins a frame. clips: number of the clips in force. A frame of a head that rests before the first update does not
  /// count.
  void frame(const FrameInput& input, uint64_t clips) {
    const bool same = !input.resting && input.camera == camera_ && input.look == look_ && clips == clips_;
    same_frames_ = same ? std::min(same_frames_ + 1, kStillFrames) : 0;
    camera_ = input.camera;
    look_ = input.look;
    clips_ = clips;
  }
  /// Call it after frame(). A head that turns on the spot moves its eyes, but not the place between them.
  void frame_of(const std::array<geometry::Camera, 2>& eyes) {
    if (std::exchange(eyes_, eyes) != eyes) same_frames_ = 0;
  }
  bool stands_still() const { return same_frames_ >= kStillFrames; }

 private:
  static constexpr int kStillFrames = 4;
  geometry::Camera camera_;
  std::optional<std::array<geometry::Camera, 2>> eyes_;  // cameras of the last pair
  Look look_;
  uint64_t clips_ = 0;
  int same_frames_ = 0;
};

/// Fits the tiles of a still picture into frames. A tile that takes longer than a frame allows is drawn in every second
/// frame, or less often.
class TileTime {
 public:
  /// A frame may draw tiles from begin_s until until_s.
  void begin(double begin_s, double until_s) {
    begin_s_ = begin_s, until_s_ = until_s;
    saved_s_ = std::min(saved_s_ + std::max(until_s - begin_s, kLeast_s), tile_s_);
  }
  /// True if another tile may be drawn now.
  bool allows(double now_s) const { return now_s + tile_s_ <= until_s_ || (now_s <= begin_s_ && saved_s_ >= tile_s_); }
  void use() { saved_s_ = 0; }
  void drawn(double took_s) { tile_s_ = tile_s_ == 0 ? took_s : 0.8 * tile_s_ + 0.2 * took_s; }

 private:
  static constexpr double kLeast_s = 0.5e-3;  // least time that a frame saves, even if its own time is over
  double begin_s_ = 0, until_s_ = 0, tile_s_ = 0, saved_s_ = 0;
};

}  // namespace telesplat::viewer
