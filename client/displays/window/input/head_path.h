// Movements of the head that a person records and plays.
#pragma once

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "common/geometry/trajectory.h"

namespace telesplat::viewer {

using HeadPath = std::vector<geometry::Trajectory::Sample>;

/// Records the camera's path.
class PathRecorder {
 public:
  bool records() const { return records_; }
  void begin() { records_ = true, path_.clear(); }
  /// Returns the path; nothing: it is too short to keep. Precondition: records().
  std::optional<HeadPath> end() {
    records_ = false;
    if (path_.size() < 2) return std::nullopt;
    return finished_ = std::exchange(path_, {});
  }
  void add(double now_s, const geometry::Pose& pose) {
    if (!records_) return;
    if (path_.empty()) from_s_ = now_s;
    const double t_s = now_s - from_s_;
    if (path_.empty() || t_s > path_.back().t_s + kLeastStep_s) path_.push_back({t_s, pose});
  }
  /// Length of the path that is being recorded, seconds.
  double length_s() const { return path_.empty() ? 0 : path_.back().t_s; }
  /// Returns the path that end() returned last, once. Empty: there is no new path.
  HeadPath take() { return std::exchange(finished_, {}); }

 private:
  // Least time between poses, so that their times also differ in the file.
  static constexpr double kLeastStep_s = 1e-5;
  bool records_ = false;
  double from_s_ = 0;
  HeadPath path_, finished_;
};

/// Plays a recorded movement, or follows a tracker, until the person takes the camera.
class HeadPlayback {
 public:
  using Tracked = std::function<std::optional<geometry::Pose>(double now_s)>;

  /// recorded: plays from the beginning on; nothing: there is no movement to play.
  explicit HeadPlayback(std::optional<geometry::Trajectory> recorded)
      : recorded_(std::move(recorded)), playing_(recorded_.has_value()) {}

  bool playing() const { return playing_; }
  /// True if next() returned the tracker's pose last.
  bool tracked() const { return follows_; }
  bool has_recorded() const { return recorded_.has_value(); }
  bool can_play() const { return recorded_ || tracked_; }
  /// Sets the movement to play, unless the person recorded or opened a path.
  void set_recorded(geometry::Trajectory recorded) {
    if (!has_own_path_) recorded_ = std::move(recorded);
  }
  /// Replaces the movement by a path of the person.
  void set_own(geometry::Trajectory path) {
    recorded_ = std::move(path);
    has_own_path_ = true;
    playback_s_ = 0;
  }
  /// A tracker moves the head from now on (nothing: no pose yet).
  void set_tracked(Tracked tracked) {
    tracked_ = std::move(tracked);
    playing_ = true;
  }
  /// Plays the tracker's poses, or the movement; from its beginning if it is at its end. Precondition: can_play().
  void play() {
    if (!tracked_ && recorded_->duration_s() > 0 && playback_s_ >= recorded_->duration_s()) playback_s_ = 0;
    playing_ = true;
  }
  /// Plays this path once, although there may be a tracker.
  void play(geometry::Trajectory path) {
    set_own(std::move(path));
    plays_path_ = playing_ = true;
  }
  /// Stops. Returns the pose at which the person takes the camera; nothing: it stays where it is.
  std::optional<geometry::Pose> stop() {
    if (!std::exchange(playing_, false)) return std::nullopt;
    return !tracked_ || std::exchange(plays_path_, false) ? std::optional(recorded_->at(playback_s_)) : told_;
  }
  void forget() { playing_ = plays_path_ = false; }
  /// True if the head stands at the end of its path.
  bool over() const {
    return playing_ && (!tracked_ || plays_path_) && recorded_->ends() && playback_s_ >= recorded_->duration_s();
  }
  /// Returns the pose dt_s after the last call; nothing: the person moves the head. The movement advances only if
  /// `advances` is set.
  std::optional<geometry::Pose> next(double now_s, double dt_s, bool advances) {
    follows_ = playing_ && tracked_ && !plays_path_;
    if (!playing_) return std::nullopt;
    if (follows_) {
      if (const auto told = tracked_(now_s)) told_ = told;
      return told_;
    }
    if (advances) playback_s_ += dt_s;
    return recorded_->at(playback_s_);
  }

 private:
  std::optional<geometry::Trajectory> recorded_;
  Tracked tracked_;
  std::optional<geometry::Pose> told_;  // newest pose from tracked_
  bool playing_ = false;
  bool has_own_path_ = false;
  bool plays_path_ = false;  // although there is a tracker
  bool follows_ = false;
  double playback_s_ = 0;
};

}  // namespace telesplat::viewer
