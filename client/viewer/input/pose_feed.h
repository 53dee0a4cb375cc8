// Head poses from a ZeroMQ publisher of any kind (docs/tracking.md).
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

/// Empty if poses can come from there: tcp://HOST:PORT or ipc://PATH; else what is wrong.
std::string complain_about_publisher(const std::string& endpoint);

/// A thread of its own hears the publisher, so that each pose has the time when it came. It takes at most kMost_s
/// messages a second; what comes faster waits in the socket's queue, and is dropped there when that is full.
class PoseFeed {
 public:
  struct Options {
    std::string endpoint;
    tracking::Prediction prediction = tracking::Prediction::kKalman;
    double ahead_s = 0;  ///< the display's poses are predicted so far ahead; 0: as long as a frame takes
  };
  /// The publisher need not be there yet. Error: names the endpoint.
  static Result<std::unique_ptr<PoseFeed>> open(const Options& options);
  ~PoseFeed();

  // ---- display thread ----
  /// Of a frame that begins; nothing: no pose has come yet.
  std::optional<geometry::Pose> begin_frame(double now_s);
  /// Where the head was shown last; nothing: nowhere.
  const std::optional<geometry::Pose>& shown() const { return shown_; }
  /// Of that pose: when the newest one that it was made from was there, and how far beyond it was predicted.
  const std::optional<PoseMoment>& moment() const { return moment_; }
  /// The frame that began last is on display.
  void presented(double now_s);
  /// Lines for the person.
  std::optional<std::string> take_news(double now_s);

  /// Any thread.
  TrackedHead::Figures figures() const;

  static constexpr int kMost_s = 100'000;

 private:
  PoseFeed(const Options& options, std::unique_ptr<net::PlainSubscriber> socket);
  void listen();

  const Options options_;
  std::unique_ptr<net::PlainSubscriber> socket_;
  mutable std::mutex mutex_;  // of head_
  TrackedHead head_;
  std::optional<geometry::Pose> shown_;
  std::optional<PoseMoment> moment_;
  double began_s_ = 0, frame_s_ = 0;  // the frame at hand; how long frames take until they are on display
  std::atomic<bool> flooded_{false}, failed_{false}, stop_{false};
  bool flood_told_ = false, failure_told_ = false;
  std::thread thread_;
};

}  // namespace telesplat::viewer
