// Brings news from the display to the worker: the head's poses, updates shown, and a person's wishes.
#pragma once

#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "client/viewer/coupling/view_requester.h"

namespace telesplat::viewer {

/// Thread-safe. Each piece of news is taken once.
class DisplayNews {
 public:
  struct Pose {
    double t_s = 0;  ///< monotonic clock
    geometry::Camera camera;
    /// Master's clock: the frame waited for the update that was requested then; 0: it did not wait.
    double waited_since_s = 0;
    RequestId shown;  ///< the newest update in what was displayed; 0: nothing was displayed
    std::optional<tracking::PosePredictor::Sample> expected{};
    bool jumped = false;  ///< the space has changed since the pose before
  };
  struct Ask {
    uint64_t number = 0;
    geometry::Camera camera;
  };
  struct News {
    std::vector<Pose> poses;  ///< in order
    std::optional<Ask> ask;   ///< the newest
  };

  /// Goes with the next pose.
  void on_expected(double t_s, const geometry::Pose& pose) {
    const std::lock_guard lock(mutex_);
    expected_ = {t_s, pose};
  }
  /// Goes with the next pose.
  void on_jump() {
    const std::lock_guard lock(mutex_);
    jumped_ = true;
  }
  void on_pose(Pose pose) {
    const std::lock_guard lock(mutex_);
    pose.expected = std::exchange(expected_, std::nullopt);
    pose.jumped = std::exchange(jumped_, false);
    news_.poses.push_back(std::move(pose));
  }
  void on_ask(const Ask& ask) {
    const std::lock_guard lock(mutex_);
    news_.ask = ask;
  }
  void on_wish(const SamplingWish& wish) {
    const std::lock_guard lock(mutex_);
    wish_ = wish;
  }

  News take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(news_, {});
  }
  std::optional<SamplingWish> take_wish() {
    const std::lock_guard lock(mutex_);
    return std::exchange(wish_, std::nullopt);
  }

 private:
  std::mutex mutex_;
  News news_;
  std::optional<tracking::PosePredictor::Sample> expected_;
  bool jumped_ = false;
  std::optional<SamplingWish> wish_;
};

}  // namespace telesplat::viewer
