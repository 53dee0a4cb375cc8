// What a packer does with what samplers send, one implementation a pipeline (points, slices, pictures). The service
// around it owns the sockets and follows the master; everything here happens in its thread, and nothing here may wait.
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

#include "common/core/ids.h"
#include "common/net/master_link.h"
#include "common/net/socket.h"
#include "common/scene/session.h"

namespace telesplat::packer {

/// Ways out of a packing. Messages are encoded already.
struct Outlets {
  std::function<void(const wire::TileDone&)> tell;                          ///< the master
  std::function<void(const wire::TileRefused&)> refuse;                     ///< the master; null: it is not told
  std::function<void(std::string_view type, std::string body)> to_viewers;  ///< to all of them
  /// To one viewer. False: dropped, because its queue is full or it is gone.
  std::function<bool(std::string_view peer, std::string_view type, std::string body)> to_viewer;
  std::function<uint64_t(const std::string& peer)> waiting;  ///< bytes that wait for this viewer; null: none do
  std::function<void(const wire::LinkReport&)> tell_link;    ///< the master
  std::function<double()> master_now;                        ///< seconds on the master's clock
  std::function<double(double local_s)> to_master_s;         ///< monotonic_s() of this machine on the master's clock

  template <class M>
  void publish(const M& message) const {
    to_viewers(M::kName, wire::encode(message));
  }
  template <class M>
  bool send(const M& message, std::string_view peer) const {
    return to_viewer(peer, M::kName, wire::encode(message));
  }
};

/// The answer of those who cannot plan: a view needs all of its rays, and none beyond.
inline wire::Plan all_rays(const wire::PlanRequest& request) {
  return {.frame = request.frame, .epoch = request.epoch, .camera = request.camera, .full = !request.extra};
}

class Packing {
 public:
  virtual ~Packing() = default;

  /// A welcome of the master came: every one is told, in order. False: the session is of another pipeline, or it is not
  /// known yet of which; nothing has changed then. A session that cannot be packed is told in the log, once a welcome.
  virtual bool follow(const wire::Welcome& session, double now_s) = 0;

  /// A message of a sampler. What makes no sense, or is of no type for this packing, is refused: `from` counts it. What
  /// is of an epoch that no welcome told yet waits for it a while. `from` outlives the packing.
  virtual void take_sampled(net::Socket& from, const net::Message& message, double now_s) = 0;
  /// A message of a viewer: likewise.
  virtual void take_state(net::Socket& from, const net::Message& message, double now_s) = 0;

  /// No more tiles of that frame come.
  virtual void end_frame(const wire::FrameEnd& /*end*/, double /*now_s*/) {}
  /// The master asks which rays of a view are needed.
  virtual wire::Plan plan(const wire::PlanRequest& request, double /*now_s*/) { return all_rays(request); }
  /// The same for rays beyond a view, by a piece of work of some tens of milliseconds. nullopt: there is no answer yet,
  /// the next call with this request goes on.
  virtual std::optional<wire::Plan> plan_piece(const wire::PlanRequest& request, double now_s) {
    return plan(request, now_s);
  }

  /// Somebody waits for a view that is being sampled: its parts will come soon, and should find the packer free.
  virtual bool hurried(double /*now_s*/) const { return false; }
  /// Nothing has come: does a piece of work that can wait, of some milliseconds. False: there is none.
  virtual bool idle(double /*now_s*/) { return false; }

  /// To be called at least every 100 ms: what happens by time.
  virtual void tick(double now_s) = 0;
  /// When tick() has something to do, at the latest; nothing: within 50 ms.
  virtual std::optional<double> due_s() const { return std::nullopt; }
  /// Adds what it counts to a status report.
  virtual void add_status(net::MasterLink::Values& values) const = 0;
};

// Keeps what came ahead of the announcement of its epoch: tiles and announcements travel on different sockets.

template <class T>
class EpochHold {
 public:
  struct Limits {
    size_t items = 256, bytes = 64u << 20;  ///< beyond them the oldest of who has most are dropped
    double patience_s = 1;                  ///< what waited longer is dropped
  };
  EpochHold() = default;
  explicit EpochHold(const Limits& limits) : limits_(limits) {}

  /// since_s: when it came, on the clock of expire(). user: whose key it came by (net::Message::user).
  void add(T item, size_t bytes, double since_s, std::string user = {}) {
    items_.push_back({std::move(item), bytes, since_s, std::move(user)});
    bytes_ += bytes;
    while (items_.size() > limits_.items || bytes_ > limits_.bytes) drop(oldest_of_largest());
  }
  /// Everything that waits, in the order in which it came; what must wait on is added again.
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
  // Seals cannot be checked yet, so one key's tiles must not push out another's. Counts what there is too much of.
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

// Who may speak for a viewer on the `state` socket: the key that spoke for it first.

class StateSenders {
 public:
  static constexpr size_t kMost = 4096;  ///< viewers that are remembered; further ones may be anybody's

  /// Without keys, and with other keys than viewers', anybody may. viewer: as the message names it.
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

/// Why a message is refused.
inline constexpr const char* kNotItsViewer = "it speaks for a viewer of another key";

}  // namespace telesplat::packer
