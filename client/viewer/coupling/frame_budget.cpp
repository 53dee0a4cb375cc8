#include "client/viewer/coupling/frame_budget.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

namespace telesplat::viewer {
namespace {

constexpr double kIdle = 0.82, kLeastShare = 0.4;
constexpr double kSmallStep = 0.02, kLargeStep = 0.06;
constexpr double kRise = 0.35, kFall = 0.2;                              // weight of a new value in the smoothed load
constexpr double kHalfFrom = 1.15, kHalfUntil = 0.7, kHalfSmooth = 0.1;  // HalfSize
constexpr int kHalfLearns = 20, kHalfLeast = 60;                         // frames
constexpr double kFollow_s = 0.07;  // time constant of SpeedDetail: after 0.3 s 1.4 % of a change is left

double median(double a, double b, double c) { return std::max(std::min(a, b), std::min(std::max(a, b), c)); }

}  // namespace

void FrameBudget::frame_done(double select_ms, double draw_ms, double points, double detail_drawn) {
  const auto sound = [](double ms) { return std::isfinite(ms) && ms >= 0; };
  if (!(budget_ms_ > 0) || !sound(select_ms) || !sound(draw_ms) || !(points > 0)) return;
  // One slow frame (another process, an upload) does not predict the next: take the median of three.
  const double now = std::min(draw_ms / std::max(budget_ms_ - select_ms, kLeastShare * budget_ms_), 3.0);
  const bool first = load_ == 0;
  const double load = first ? now : median(now, last_[0], last_[1]);
  last_[1] = first ? now : last_[0];
  last_[0] = now;
  load_ = first ? load : load_ + (load > load_ ? kRise : kFall) * (load - load_);

  double step = 0;
  if (load_ > 1) {
    // If time is quadratic in detail, the root of the load closes the gap. An eighth of that a frame does not
    // overshoot, though the load is known a few frames late and time may rise with the fourth power where levels
    // change.
    step = -std::min(load_ > 2 ? kLargeStep : kSmallStep, 0.125 * 0.5 * std::log(load_) + 0.001);
  } else if (load_ < kIdle && detail_drawn > 0.999 * detail_) {
    step = std::min(kSmallStep, 0.1 * 0.5 * std::log(kIdle / std::max(load_, 0.05)) + 0.001);
  }
  detail_ = std::clamp(detail_ * std::exp(step), least_, 1.0);
}

void HalfSize::frame_done(double draw_ms, bool least) {
  if (!(budget_ms_ > 0) || !std::isfinite(draw_ms) || draw_ms < 0) return;
  const double now = std::min(draw_ms / budget_ms_, 3.0);
  load_ += (median(now, last_[0], last_[1]) - load_) * std::max(kHalfSmooth, 1.0 / ++frames_);
  last_[1] = std::exchange(last_[0], now);
  if (frames_ < kHalfLearns) return;
  if (on_ && frames_ == kHalfLearns) saved_ = std::clamp(load_before_ / std::max(load_, 0.05), 1.2, 4.0);
  if (on_ ? frames_ < kHalfLeast || load_ * saved_ > kHalfUntil : !least || load_ < kHalfFrom) return;
  load_before_ = load_;
  load_ = last_[0] = last_[1] = 0, frames_ = 0;
  on_ = !on_;
}

double screen_movement(const geometry::Pose& from, const geometry::Pose& to, double depth_m, double focal_px) {
  // Unit quaternions of rotations that differ by angle a are 2 sin(a / 4) apart; q and -q are the same rotation.
  const glm::dquat& a = from.orientation;
  const glm::dquat b = glm::dot(a, to.orientation) < 0 ? -to.orientation : to.orientation;
  const double apart = std::sqrt((a.w - b.w) * (a.w - b.w) + (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y) +
                                 (a.z - b.z) * (a.z - b.z));
  const double angle_rad = 4 * std::asin(std::min(0.5 * apart, 1.0));
  return focal_px * (angle_rad + glm::distance(from.position_room, to.position_room) / std::max(depth_m, 0.01));
}

void SpeedDetail::frame(double now_s, const geometry::Camera& camera, double depth_m) {
  const double frame_s = now_s - last_s_;
  if (has_last_ && frame_s > 0) {
    const double pixels = screen_movement(last_, camera.pose, depth_m, camera.focal_x()) / (60 * frame_s);
    const double wanted = std::clamp(kFreePixels / std::max(pixels, 1e-9), kLeastDetail, 1.0);
    detail_ *= std::pow(wanted / detail_, 1 - std::exp(-frame_s / kFollow_s));
  }
  if (has_last_ && !(frame_s > 0)) return;
  has_last_ = true;
  last_s_ = now_s;
  last_ = camera.pose;
}

}  // namespace telesplat::viewer
