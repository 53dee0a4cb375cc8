// A packer's work on the samplers' messages, one implementation per pipeline (points, slices, pictures). The service
// around it owns the sockets and follows the master; everything here runs in its thread, and nothing here may block.
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/core/ids.h"
#include "common/net/master_link.h"
#include "common/net/socket.h"
#include "common/scene/session.h"

namespace telesplat::packer {

/// Outgoing channels of a packing. Messages are encoded already.
struct Outlets {
  std::function<void(const wire::TileDone&)> tell;                          ///< to the master
  std::function<void(const wire::TileRefused&)> refuse;                     ///< to the master; null: not reported
  std::function<void(std::string_view type, std::string body)> to_viewers;  ///< to all viewers
  /// Sends to one viewer. False: dropped, because its queue is full or it is gone.
  std::function<bool(std::string_view peer, std::string_view type, std::string body)> to_viewer;
  std::function<uint64_t(const std::string& peer)> waiting;  ///< bytes queued for this viewer; null: no queue
  std::function<void(const wire::LinkReport&)> tell_link;    ///< to the master
  std::function<double()> master_now;                        ///< seconds on the master's clock
  std::function<double(double local_s)> to_master_s;         ///< monotonic_s() of this machine -> master's clock

  template <class M>
  void publish(const M& message) const {
    to_viewers(M::kName, wire::encode(message));
  }
  template <class M>
  bool send(const M& message, std::string_view peer) const {
    return to_viewer(peer, M::kName, wire::encode(message));
  }
};

/// The answer of packings that cannot plan: a view needs all of its rays, and no rays beyond it.
inline wire::Plan all_rays(const wire::PlanRequest& request) {
  return {.frame = request.frame, .epoch = request.epoch, .camera = request.camera, .full = !request.extra};
}

class Packing {
 public:
  virtual ~Packing() = default;

  /// Takes a welcome of the master; each one is passed on, in order. False: the session's pipeline is another or not
  /// known yet; nothing has changed then. A session that cannot be packed is logged once per welcome.
  virtual bool follow(const wire::Welcome& session, double now_s) = 0;

  /// Takes a sampler's message. `from`, which outlives the packing, refuses and counts it if it is invalid or of a type
  /// that this packing does not take. A message whose epoch no welcome has announced yet waits a while.
  virtual void take_sampled(net::Socket& from, const net::Message& message, double now_s) = 0;
  /// Takes a viewer's message, with the same rules.
  virtual void take_state(net::Socket& from, const net::Message& message, double now_s) = 0;

  /// Returns sockets of its own; receive() takes their messages.
  virtual std::vector<net::Socket*> sockets() { return {}; }
  virtual void receive() {}

  /// No more tiles of this frame come.
  virtual void end_frame(const wire::FrameEnd& /*end*/, double /*now_s*/) {}
  /// Answers the master, which asks which rays of a view are needed.
  virtual wire::Plan plan(const wire::PlanRequest& request, double /*now_s*/) { return all_rays(request); }
  /// The same for rays beyond a view, in pieces of work of some tens of milliseconds. nullopt: no answer yet, the next
  /// call with this request goes on.
  virtual std::optional<wire::Plan> plan_piece(const wire::PlanRequest& request, double now_s) {
    return plan(request, now_s);
  }

  /// True while a viewer waits for a view that is being sampled: its parts come soon and should find the packer free.
  virtual bool hurried(double /*now_s*/) const { return false; }
  /// Called when no message has come: does a piece of deferrable work, of some milliseconds. False: no such work.
  virtual bool idle(double /*now_s*/) { return false; }

  /// Does the work that depends on time. To be called at least every 100 ms.
  virtual void tick(double now_s) = 0;
  /// Returns when tick() is next due, at the latest; nullopt: within 50 ms.
  virtual std::optional<double> due_s() const { return std::nullopt; }
  /// Adds the packing's counters to a status report.
  virtual void add_status(net::MasterLink::Values& values) const = 0;
};

// Keeps messages that came before their epoch was announced: tiles and announcements travel on different sockets.

template <class T>
class EpochHold {
 public:
  struct Limits {
    size_t items = 256, bytes = 64u << 20;  ///< beyond them, the oldest item of the key that holds most is dropped
    double patience_s = 1;                  ///< items that waited longer are dropped
  };
  EpochHold() = default;
  explicit EpochHold(const Limits& limits) : limits_(limits) {}

  /// since_s: when the item came, on the clock of expire(). user: the key it was sent with (net::Message::user).
  void add(T item, size_t bytes, double since_s, std::string user = {}) {
    items_.push_back({std::move(item), bytes, since_s, std::move(user)});
    bytes_ += bytes;
    while (items_.size() > limits_.items || bytes_ > limits_.bytes) drop(oldest_of_largest());
  }
  /// Items that wait, in the order in which they came; the caller adds again those that must wait on.
  struct Waiting {
    T item;
    size_t bytes;
    double since_s;
    std::string user;
  };
  std::deque<Waiting> take() {
    bytes_ = 0;
    return std::exchange(items_, {});
  }
  void expire(double now_s) {
    while (!items_.empty() && now_s - items_.front().since_s > limits_.patience_s) drop(items_.begin());
  }
  bool empty() const { return items_.empty(); }
  size_t size() const { return items_.size(); }
  uint64_t dropped() const { return dropped_; }

 private:
  using At = typename std::deque<Waiting>::iterator;
  // Seals cannot be checked yet, so one key's tiles must not push out another's. Weighs by the limit that is exceeded.
  At oldest_of_largest() {
    const bool counts = items_.size() > limits_.items;
    std::map<std::string_view, size_t> held;
    for (const Waiting& w : items_) held[w.user] += counts ? 1 : w.bytes;
    const auto most = std::ranges::max_element(held, {}, [](const auto& h) { return h.second; });
    return std::ranges::find(items_, most->first, &Waiting::user);
  }
  void drop(At at) {
    bytes_ -= at->bytes;
    items_.erase(at);
    ++dropped_;
  }

  Limits limits_;
  std::deque<Waiting> items_;
  size_t bytes_ = 0;
  uint64_t dropped_ = 0;
};

// Holds each viewer's id on the `state` socket to one key: the first that spoke for it.

class StateSenders {
 public:
  static constexpr size_t kMost = 4096;  ///< viewers that are remembered; any key may speak for further ones

  /// Always true without keys, and for keys of other roles. viewer: as the message names it.
  bool may_speak(const net::Message& message, InstanceId viewer) {
    if (message.role != net::Role::kViewer) return true;
    const auto owner = owners_.find(viewer);
    if (owner != owners_.end()) return owner->second == message.user;
    if (owners_.size() < kMost) owners_.emplace(viewer, message.user);
    return true;
  }

 private:
  std::unordered_map<InstanceId, std::string> owners_;
};

/// Reason given when a message is refused.
inline constexpr const char* kNotItsViewer = "it speaks for a viewer of another key";

}  // namespace telesplat::packer
