#include "tools/lab/pose_replay/schedule.h"

#include <algorithm>
#include <utility>

namespace telesplat::lab {
namespace {

constexpr double kLeastStep_s = 1e-3;

}  // namespace

Schedule::Schedule(std::vector<geometry::Trajectory::Sample> samples, bool loop, const Disturbance& disturbance)
    : samples_(std::move(samples)), loop_(loop), disturbance_(disturbance), random_(disturbance.seed) {}

double Schedule::length_s() const { return loop_ ? 0 : samples_.back().t_s - samples_.front().t_s; }

std::optional<Schedule::Due> Schedule::next() {
  std::uniform_real_distribution<double> share(0, 1);
  for (;;) {
    if (at_ == samples_.size()) {
      if (!loop_ || disturbance_.loss >= 1) return std::nullopt;
      const double length_s = samples_.back().t_s - samples_.front().t_s;
      round_s_ += length_s + std::max(length_s / double(std::max<size_t>(samples_.size(), 2) - 1), kLeastStep_s);
      at_ = 0;
    }
    const auto& sample = samples_[at_++];
    const bool lost = share(random_) < disturbance_.loss;
    const double late_s = share(random_) * disturbance_.jitter_s;
    if (lost) {
      ++lost_;
      continue;
    }
    const double t_s = round_s_ + sample.t_s - samples_.front().t_s;
    send_s_ = std::max(send_s_, t_s + late_s);
    return Due{send_s_, t_s, sample.pose};
  }
}

}  // namespace telesplat::lab
