// Predicts a head's pose from past poses, by its velocity or by a Kalman filter.
#pragma once

#include <array>
#include <deque>
#include <optional>
#include <string_view>

#include "client/viewer/tracking/head_filter.h"

namespace telesplat::tracking {

enum class Prediction {
  kNone,      ///< the newest pose
  kVelocity,  ///< that pose, moved on with the velocity of the last 0.15 s
  kKalman     ///< HeadFilter
};
inline constexpr std::array<const char*, 3> kPredictionNames{"none", "velocity", "kalman"};
std::optional<Prediction> prediction_named(std::string_view name);
const char* name_of(Prediction prediction);

/// Extrapolates a head's pose. Any clock, one thread.
class PosePredictor {
 public:
  explicit PosePredictor(Prediction method = Prediction::kKalman) : method_(method) {}

  /// Poses that are not later than the newest are ignored. A pose that no head can have reached (recentring, another
  /// person, a broken tracker) begins anew.
  void add(double t_s, const geometry::Pose& pose);
  /// Returns a pose at most kMaxMove_m and kMaxTurn_rad away from the newest one.
  geometry::Pose predict(double t_s) const;
  /// Returns `pose` after dt_s of this head's present movement, within the same limits.
  geometry::Pose carried(const geometry::Pose& pose, double dt_s) const;
  /// The newest pose and its time.
  struct Sample {
    double t_s;
    geometry::Pose pose;
  };
  std::optional<Sample> newest() const { return samples_.empty() ? std::nullopt : std::optional(samples_.back()); }
  double speed_m_s() const;
  double turn_rad_s() const;
  /// Forgets all poses.
  void forget();

  static constexpr double kMaxMove_m = 0.3, kMaxTurn_rad = 0.6;

 private:
  struct Velocity {
    glm::dvec3 linear{0.0}, angular{0.0};
  };  // room space
  Velocity velocity() const;
  geometry::Pose unbounded(double t_s) const;

  Prediction method_;
  std::deque<Sample> samples_;  // the last 0.15 s
  HeadFilter filter_;
};

}  // namespace telesplat::tracking
