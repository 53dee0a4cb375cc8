#include "client/viewer/input/pose_feed.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <utility>

#include "common/core/clock.h"
#include "common/core/guarded.h"
#include "common/core/log.h"
#include "common/core/within.h"

namespace telesplat::viewer {
namespace {

constexpr int kPoll_ms = 50;
constexpr double kTurn_s = 0.01;  // a turn takes at most a hundredth of kMost_s messages
constexpr int kMostATurn = int(PoseFeed::kMost_s * kTurn_s);
constexpr double kSilence_s = 1;      // after this silence it connects to the publisher anew
constexpr double kMostFrame_s = 0.1;  // longer frames waited for something: no reason to look farther ahead

}  // namespace

std::string complain_about_publisher(const std::string& endpoint) {
  if (endpoint.starts_with("ipc://") && endpoint.size() > 6) return {};
  const size_t colon = endpoint.rfind(':');
  if (!endpoint.starts_with("tcp://") || colon <= 6) return "is not tcp://HOST:PORT";
  unsigned port = 0;
  const char* end = endpoint.data() + endpoint.size();
  const auto [stop, error] = std::from_chars(endpoint.data() + colon + 1, end, port);
  return error != std::errc() || stop != end || port < 1 || port > 65535 ? "the port is not in 1..65535" : "";
}

Result<std::unique_ptr<PoseFeed>> PoseFeed::open(const Options& options) {
  auto socket = net::PlainSubscriber::connect(options.endpoint, {.most_bytes = wire::kMaxHeadPoseBytes});
  if (!socket) return Error{"--poses: " + socket.error().text};
  return std::unique_ptr<PoseFeed>(new PoseFeed(options, std::move(*socket)));
}

PoseFeed::PoseFeed(const Options& options, std::unique_ptr<net::PlainSubscriber> socket)
    : options_(options), socket_(std::move(socket)), head_(options.prediction), thread_([this] {
        const Status heard = guarded("listening to poses", [this] { listen(); });
        if (!heard) failed_ = true;
      }) {}

PoseFeed::~PoseFeed() {
  stop_ = true;
  thread_.join();
}

void PoseFeed::listen() {
  log::RateLimiter refusals;
  double turn_s = monotonic_s(), heard_s = turn_s;
  int taken = 0;  // messages in this turn
  while (!stop_) {
    const bool there = socket_->wait(kPoll_ms);
    const double began_s = monotonic_s();
    if (began_s - turn_s >= kTurn_s) {
      flooded_ = taken >= kMostATurn;
      turn_s = began_s, taken = 0;
    }
    if (there) heard_s = began_s;
    if (!there && began_s - heard_s >= kSilence_s) {
      heard_s = began_s;
      socket_->connect_again();
    }
    for (; there && taken < kMostATurn && !stop_; ++taken) {
      const auto body = socket_->receive();
      if (!body) break;
      const auto pose = wire::decode_head_pose({reinterpret_cast<const std::byte*>(body->data()), body->size()});
      const double now_s = monotonic_s();
      if (!pose && refusals.allow(now_s))
        log::warn("a message from {} is no pose: it {}", options_.endpoint, pose.error().text);
      const std::lock_guard lock(mutex_);
      pose ? head_.told(*pose, now_s) : head_.refused();
    }
    const double rest_s = turn_s + kTurn_s - monotonic_s();
    if (taken >= kMostATurn && rest_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(rest_s));
  }
}

std::optional<geometry::Pose> PoseFeed::begin_frame(double now_s) {
  began_s_ = now_s;
  const std::lock_guard lock(mutex_);
  const auto pose = head_.at(now_s, options_.ahead_s > 0 ? options_.ahead_s : frame_s_);
  if (pose) shown_ = pose, moment_ = head_.moment();
  return pose;
}

void PoseFeed::presented(double now_s) {
  const double frame_s = within(now_s - began_s_, 0.0, kMostFrame_s);
  frame_s_ = frame_s_ == 0 ? frame_s : 0.9 * frame_s_ + 0.1 * frame_s;
}

std::optional<std::string> PoseFeed::take_news(double now_s) {
  const auto named = [&](const std::string& text) { return fmt::format("{}: {}", options_.endpoint, text); };
  if (flooded_ && !std::exchange(flood_told_, true))
    return named(fmt::format("more than {} messages a second; what is too much is dropped", kMost_s));
  if (failed_ && !std::exchange(failure_told_, true)) return named("poses are listened to no more");
  const std::lock_guard lock(mutex_);
  const auto news = head_.take_news(now_s);
  return news ? std::optional(named(*news)) : std::nullopt;
}

TrackedHead::Figures PoseFeed::figures() const {
  const std::lock_guard lock(mutex_);
  return head_.figures();
}

}  // namespace telesplat::viewer
