// Receives head poses from any ZeroMQ publisher (docs/tracking.md).
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "client/viewer/input/tracked_head.h"
#include "common/net/plain/plain_socket.h"

namespace telesplat::viewer {

/// Says what is wrong with the endpoint; empty: it is tcp://HOST:PORT or ipc://PATH.
std::string complain_about_publisher(const std::string& endpoint);

/// A thread of its own listens to the publisher, so that each pose has its time of arrival. It takes at most kMost_s
/// messages a second; others wait in the socket's queue, and are dropped there when it is full.
class PoseFeed {
 public:
  struct Options {
    std::string endpoint;
    tracking::Prediction prediction = tracking::Prediction::kKalman;
    double ahead_s = 0;  ///< how far ahead the display's poses are predicted; 0: as long as a frame takes
  };
  /// The publisher need not be there yet. Error: names the endpoint.
  static Result<std::unique_ptr<PoseFeed>> open(const Options& options);
  ~PoseFeed();

  // ---- display thread ----
  /// Returns the pose of a frame that begins; nothing: no pose has come yet.
  std::optional<geometry::Pose> begin_frame(double now_s);
  /// The pose that was shown last; nothing: no pose was shown.
  const std::optional<geometry::Pose>& shown() const { return shown_; }
  /// When the newest pose behind shown() was taken, and how far beyond it shown() was predicted.
  const std::optional<PoseMoment>& moment() const { return moment_; }
  /// The frame that began last is on display.
  void presented(double now_s);
  /// Returns a line for the person, if there is news.
  std::optional<std::string> take_news(double now_s);

  /// Any thread.
  TrackedHead::Figures figures() const;

  static constexpr int kMost_s = 100'000;

 private:
  PoseFeed(const Options& options, std::unique_ptr<net::PlainSubscriber> socket);
  void listen();

  const Options options_;
  std::unique_ptr<net::PlainSubscriber> socket_;
  mutable std::mutex mutex_;  // guards head_
  TrackedHead head_;
  std::optional<geometry::Pose> shown_;
  std::optional<PoseMoment> moment_;
  double began_s_ = 0, frame_s_ = 0;  // start of the frame at hand; mean time until a frame is on display
  std::atomic<bool> flooded_{false}, failed_{false}, stop_{false};
  bool flood_told_ = false, failure_told_ = false;
  std::thread thread_;
};

}  // namespace telesplat::viewer
