// A head whose poses another program tells: its clock, its silence, its mistakes. Without sockets and clocks.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/viewer/tracking/pose_predictor.h"
#include "client/viewer/tracking/prediction_meter.h"
#include "common/wire/head_pose.h"

namespace telesplat::viewer {

/// Seconds; taken_s on the monotonic clock.
struct PoseMoment {
  double taken_s = 0;  ///< the newest pose that it was made from was taken
  double ahead_s = 0;  ///< it was predicted so far beyond that
};

/// One thread, or one at a time. Times are those of our monotonic clock where nothing else is said.
class TrackedHead {
 public:
  explicit TrackedHead(tracking::Prediction method)
      : predicts_(method != tracking::Prediction::kNone), predictor_(method) {}

  /// A pose that arrived. Poses that are older than the newest are passed over and counted; where all are for
  /// kRestart_s, their sender counts time anew and is followed.
  void told(const wire::HeadPose& pose, double arrived_s);
  /// What arrived was no pose.
  void refused() { ++refused_; }

  /// Where the head is at now_s + ahead_s. Predictions reach kMostAhead_s beyond the newest pose; of a silent tracker
  /// the head stays there. Nothing: no pose has come yet.
  std::optional<geometry::Pose> at(double now_s, double ahead_s);
  /// Of the pose that at() returned last.
  PoseMoment moment() const { return moment_; }

  /// A line for the person where something changed: poses come, no longer come, come again, cannot be read.
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
  double arrived_s_ = -1e9;  // the newest pose
  double refusal_told_s_ = -1e9;
  enum class Told { kNothing, kPoses, kSilence } told_ = Told::kNothing;
};

}  // namespace telesplat::viewer
