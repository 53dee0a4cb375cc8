// Predicts where a head will be when what is asked for it arrives, and measures the errors.
#pragma once

#include <algorithm>
#include <optional>

#include "client/viewer/tracking/pose_predictor.h"
#include "client/viewer/tracking/prediction_meter.h"

namespace telesplat::tracking {

/// Any clock, one thread.
class HeadForecast {
 public:
  explicit HeadForecast(Prediction method) : predictor_(method) {}

  void on_pose(double t_s, const geometry::Pose& pose) {
    predictor_.add(t_s, pose);
    meter_.actual(t_s, pose);
  }
  /// Past movement means nothing from now on.
  void on_jump() {
    predictor_.forget();
    expected_.reset();
  }
  /// The head's tracker expects it here at t_s, which lies ahead: this is better than a prediction from poses.
  void on_expected(double t_s, const geometry::Pose& pose) { expected_ = {t_s, pose}; }
  /// Returns the pose at `at_s`, predicted at now_s for a head that is at `now`.
  geometry::Pose predict(double now_s, const geometry::Pose& now, double at_s) {
    const geometry::Pose out = expected_at(at_s);
    meter_.predicted(now_s, now, at_s, out);
    return out;
  }
  /// Movement in ahead_s at the present speed: radians, or metres / 0.6.
  double motion(double ahead_s) const {
    return predictor_.turn_rad_s() * ahead_s + predictor_.speed_m_s() * ahead_s / 0.6;
  }
  PredictionMeter::Figures errors() const { return meter_.figures(); }

 private:
  static constexpr double kMostBeyond_s = 0.02;  // a tracker's pose for a time this much later is not used

  // Uses the tracker's expected pose until a pose of that time or later is known. Beyond its time, the head's velocity
  // carries it on.
  geometry::Pose expected_at(double t_s) const {
    const auto newest = predictor_.newest();
    const bool ahead = expected_ && newest && expected_->t_s > newest->t_s && expected_->t_s - t_s < kMostBeyond_s;
    return ahead ? predictor_.carried(expected_->pose, std::max(0.0, t_s - expected_->t_s)) : predictor_.predict(t_s);
  }

  PosePredictor predictor_;
  PredictionMeter meter_;
  std::optional<PosePredictor::Sample> expected_;
};

}  // namespace telesplat::tracking
