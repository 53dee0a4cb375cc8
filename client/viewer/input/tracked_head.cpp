#include "client/viewer/input/tracked_head.h"

#include <fmt/format.h>

#include <algorithm>

namespace telesplat::viewer {
namespace {

constexpr double kRefusalsToldEvery_s = 5.0;

}  // namespace

void TrackedHead::told(const wire::HeadPose& head, double arrived_s) {
  ++poses_;
  arrived_s_ = arrived_s;
  double t_s = head.t_s ? clock_.local_s(*head.t_s, arrived_s) : arrived_s;
  const auto newest = predictor_.newest();
  if (newest && t_s <= newest->t_s) {
    ++late_;
    if (!late_since_s_) late_since_s_ = arrived_s;
    if (arrived_s - *late_since_s_ < kRestart_s) return;
    clock_.restart();
    predictor_.forget();
    t_s = arrived_s;
    if (head.t_s) clock_.local_s(*head.t_s, arrived_s);
  }
  late_since_s_.reset();
  predictor_.add(t_s, head.pose);
  meter_.actual(t_s, head.pose);
}

std::optional<geometry::Pose> TrackedHead::at(double now_s, double ahead_s) {
  const auto newest = predictor_.newest();
  if (!newest) return std::nullopt;
  const double for_s = std::min(now_s + std::max(ahead_s, 0.0), newest->t_s + kMostAhead_s);
  const geometry::Pose expected = predictor_.predict(for_s);
  moment_ = {newest->t_s, predicts_ ? for_s - newest->t_s : 0};
  if (now_s - arrived_s_ < kSilent_s) meter_.predicted(newest->t_s, newest->pose, for_s, expected);
  return expected;
}

std::optional<std::string> TrackedHead::take_news(double now_s) {
  if (refused_ > refused_told_ && now_s - refusal_told_s_ > kRefusalsToldEvery_s) {
    refusal_told_s_ = now_s;
    const uint64_t more = refused_ - refused_told_;
    refused_told_ = refused_;
    if (more == 1) return "a message was no pose and did nothing";
    return fmt::format("{} messages were no poses and did nothing", more);
  }
  const bool silent = now_s - arrived_s_ > kSilent_s;
  if (!silent && told_ != Told::kPoses) {
    const bool again = told_ == Told::kSilence;
    told_ = Told::kPoses;
    return again ? "poses come again" : "poses move the head";
  }
  if (silent && told_ == Told::kPoses) {
    told_ = Told::kSilence;
    return fmt::format("no poses for {} s: the head stays where it was", kSilent_s);
  }
  return std::nullopt;
}

}  // namespace telesplat::viewer
