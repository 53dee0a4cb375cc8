// Predictions of a head's pose.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "client/viewer/tracking/head_filter.h"
#include "client/viewer/tracking/pose_predictor.h"

namespace telesplat::tracking {
namespace {

geometry::Pose turned(double yaw_rad, const glm::dvec3& p) { return {p, glm::angleAxis(yaw_rad, glm::dvec3(0, 1, 0))}; }

// A head that sways by 0.1 m and 0.3 rad with a period of two seconds.
geometry::Pose swaying(double t_s) {
  const double phase = std::sin(3.14159265 * t_s);
  return turned(0.3 * phase, {0.1 * phase, 1.5, 0});
}

struct Errors {
  double m = 0, rad = 0;
};

// Mean errors at a horizon of 60 ms; poses come rate_hz times a second with that noise.
Errors errors(Prediction method, double rate_hz, double noise_m = 0, double noise_rad = 0) {
  PosePredictor predictor(method);
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Errors out;
  int count = 0;
  for (int i = 0; i < int(10 * rate_hz); ++i) {
    const double t_s = i / rate_hz;
    geometry::Pose pose = swaying(t_s);
    pose.position_room += noise_m * glm::dvec3(normal(random), normal(random), normal(random));
    pose.orientation =
        rotation(noise_rad * glm::dvec3(normal(random), normal(random), normal(random))) * pose.orientation;
    predictor.add(t_s, pose);
    if (t_s < 1) continue;
    const geometry::Pose expected = predictor.predict(t_s + 0.06), there = swaying(t_s + 0.06);
    out.m += glm::distance(expected.position_room, there.position_room);
    out.rad += angle_between(expected.orientation, there.orientation);
    ++count;
  }
  return {out.m / count, out.rad / count};
}

TEST(PosePredictor, FollowsConstantVelocity) {
  PosePredictor predictor(Prediction::kVelocity);
  for (int i = 0; i <= 20; ++i) predictor.add(i * 0.01, turned(0.5 * i * 0.01, {0.4 * i * 0.01, 0, 0}));
  const geometry::Pose p = predictor.predict(0.3);
  EXPECT_NEAR(p.position_room.x, 0.4 * 0.3, 1e-9);
  EXPECT_NEAR(glm::angle(p.orientation), 0.5 * 0.3, 1e-6);
  EXPECT_NEAR(predictor.speed_m_s(), 0.4, 1e-9);
  EXPECT_NEAR(predictor.turn_rad_s(), 0.5, 1e-6);
}

TEST(PosePredictor, TheFilterFindsAConstantVelocity) {
  PosePredictor predictor(Prediction::kKalman);
  for (int i = 0; i <= 200; ++i) predictor.add(i * 0.01, turned(0.5 * i * 0.01, {0.4 * i * 0.01, 0, 0}));
  EXPECT_NEAR(predictor.speed_m_s(), 0.4, 0.04);
  EXPECT_NEAR(predictor.turn_rad_s(), 0.5, 0.1);
  // Heads that turn come to rest: the predictor expects a little less than a straight line would give.
  const geometry::Pose p = predictor.predict(2.05);
  EXPECT_NEAR(p.position_room.x, 0.4 * 2.05, 0.003);
  EXPECT_NEAR(glm::angle(p.orientation), 0.5 * 2.05, 0.01);
}

TEST(PosePredictor, EveryWayIsBetterThanNone) {
  for (const double rate_hz : {30.0, 72.0, 200.0}) {
    const Errors none = errors(Prediction::kNone, rate_hz), velocity = errors(Prediction::kVelocity, rate_hz),
                 kalman = errors(Prediction::kKalman, rate_hz);
    EXPECT_LT(velocity.m, 0.6 * none.m) << rate_hz;
    EXPECT_LT(kalman.m, 0.4 * none.m) << rate_hz;
    EXPECT_LT(kalman.m, velocity.m) << rate_hz;
    EXPECT_LT(kalman.rad, 0.6 * none.rad) << rate_hz;
  }
}

TEST(PosePredictor, NoiseOfATrackerDoesNotMakeTheFilterWild) {
  const Errors none = errors(Prediction::kNone, 100, 0.002, 0.005),
               kalman = errors(Prediction::kKalman, 100, 0.002, 0.005);
  EXPECT_LT(kalman.m, 0.6 * none.m);
  EXPECT_LT(kalman.rad, none.rad);
}

TEST(PosePredictor, StaysNearWhateverTheSpeed) {
  for (const auto method : {Prediction::kNone, Prediction::kVelocity, Prediction::kKalman}) {
    PosePredictor predictor(method);
    for (int i = 0; i <= 50; ++i) predictor.add(i * 0.01, turned(20.0 * i * 0.01, {7.0 * i * 0.01, 0, 0}));
    const geometry::Pose last = predictor.newest()->pose, p = predictor.predict(10);
    EXPECT_LE(glm::distance(p.position_room, last.position_room), 0.3 + 1e-9);
    EXPECT_LE(angle_between(p.orientation, last.orientation), 0.6 + 1e-6);
    EXPECT_LE(glm::distance(predictor.carried(last, 10).position_room, last.position_room), 0.3 + 1e-9);
  }
}

TEST(PosePredictor, ARestingHeadStaysWhereItIs) {
  for (const auto method : {Prediction::kNone, Prediction::kVelocity, Prediction::kKalman}) {
    PosePredictor predictor(method);
    const geometry::Pose pose = turned(0.3, {1, 2, 3});
    predictor.add(0, pose);
    EXPECT_TRUE(predictor.predict(1).position_room == pose.position_room);
    EXPECT_NEAR(std::abs(glm::dot(predictor.predict(1).orientation, pose.orientation)), 1, 1e-15);
    predictor.add(0.1, pose);
    EXPECT_NEAR(glm::distance(predictor.predict(1).position_room, pose.position_room), 0, 1e-12);
    EXPECT_NEAR(predictor.speed_m_s(), 0, 1e-12);
  }
}

TEST(PosePredictor, AHeadThatComesToRestIsBelievedSoon) {
  PosePredictor predictor;
  double t_s = 0;
  for (; t_s < 1; t_s += 0.01) predictor.add(t_s, turned(0.8 * t_s, {0.5 * t_s, 0, 0}));
  const geometry::Pose rest = turned(0.8, {0.5, 0, 0});
  for (; t_s < 1.4; t_s += 0.01) predictor.add(t_s, rest);
  EXPECT_LT(predictor.speed_m_s(), 0.005);
  EXPECT_LT(predictor.turn_rad_s(), 0.02);
  EXPECT_LT(glm::distance(predictor.predict(t_s + 0.2).position_room, rest.position_room), 0.001);
}

TEST(PosePredictor, AJumpIsNoMovement) {
  for (const auto method : {Prediction::kVelocity, Prediction::kKalman}) {
    PosePredictor predictor(method);
    for (int i = 0; i < 50; ++i) predictor.add(i * 0.01, turned(0, {0.001 * i, 0, 0}));
    const geometry::Pose there = turned(2, {1, 1, 1});
    predictor.add(0.5, there);
    EXPECT_EQ(glm::distance(predictor.predict(0.6).position_room, there.position_room), 0);
    EXPECT_EQ(predictor.speed_m_s(), 0);
  }
}

TEST(PosePredictor, PosesThatAreNotLaterAreNoNews) {
  PosePredictor predictor;
  predictor.add(1, turned(0, {1, 0, 0}));
  predictor.add(1, turned(0, {2, 0, 0}));
  predictor.add(0.5, turned(0, {3, 0, 0}));
  predictor.add(std::nan(""), turned(0, {4, 0, 0}));
  EXPECT_EQ(predictor.newest()->pose.position_room.x, 1);
}

TEST(PosePredictor, HasNames) {
  for (const auto method : {Prediction::kNone, Prediction::kVelocity, Prediction::kKalman})
    EXPECT_EQ(prediction_named(name_of(method)), method);
  EXPECT_FALSE(prediction_named("gaze"));
}

TEST(Rotation, VectorsAndQuaternionsAreTheSame) {
  for (const glm::dvec3 v : {glm::dvec3(0.1, -0.2, 0.3), glm::dvec3(1e-12, 0, 0), glm::dvec3(0, 3, 0)})
    EXPECT_NEAR(glm::distance(rotation_vector(rotation(v)), v), 0, 1e-9);
  EXPECT_NEAR(angle_between(rotation({0, 0.5, 0}), -rotation({0, 0.2, 0})), 0.3, 1e-12);
}

}  // namespace
}  // namespace telesplat::tracking
