// Follows a head whose poses another program sends: its clock, its silence, its mistakes. Without sockets and clocks.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/viewer/tracking/pose_predictor.h"
#include "client/viewer/tracking/prediction_meter.h"
#include "common/wire/head_pose.h"

namespace telesplat::viewer {

/// Seconds; taken_s is on the monotonic clock.
struct PoseMoment {
  double taken_s = 0;  ///< when the newest pose behind it was taken
  double ahead_s = 0;  ///< how far beyond that it was predicted
};

/// Used by one thread, or by one at a time. Times are on our monotonic clock unless a comment says otherwise.
class TrackedHead {
 public:
  explicit TrackedHead(tracking::Prediction method)
      : predicts_(method != tracking::Prediction::kNone), predictor_(method) {}

  /// Takes a pose that arrived. A pose older than the newest is counted and dropped; if all are for kRestart_s, their
  /// sender has begun to count time anew and is followed.
  void told(const wire::HeadPose& pose, double arrived_s);
  /// A message arrived that is not a pose.
  void refused() { ++refused_; }

  /// Returns the head at now_s + ahead_s. Predictions reach kMostAhead_s beyond the newest pose; if the tracker is
  /// silent, the head stays there. Nothing: no pose has come yet.
  std::optional<geometry::Pose> at(double now_s, double ahead_s);
  /// When the pose that at() returned last was taken, and how far it was predicted.
  PoseMoment moment() const { return moment_; }

  /// Returns a line for the person after a change: poses come, stop, come again, cannot be read.
  std::optional<std::string> take_news(double now_s);

  struct Figures {
    uint64_t poses = 0, late = 0, refused = 0;
    tracking::PredictionMeter::Figures prediction;
  };
  Figures figures() const { return {poses_, late_, refused_, meter_.figures()}; }

  static constexpr double kSilent_s = 0.5, kRestart_s = 0.25, kMostAhead_s = 0.1;

 private:
  const bool predicts_;
  PoseMoment moment_;
  tracking::PosePredictor predictor_;
  tracking::PredictionMeter meter_;
  tracking::PoseClock clock_;
  uint64_t poses_ = 0, late_ = 0, refused_ = 0, refused_told_ = 0;
  std::optional<double> late_since_s_;
  double arrived_s_ = -1e9;  // when the newest pose arrived
  double refusal_told_s_ = -1e9;
  enum class Told { kNothing, kPoses, kSilence } told_ = Told::kNothing;
};

}  // namespace telesplat::viewer
