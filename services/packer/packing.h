// What a packer does with what samplers send, one implementation a pipeline (points, slices, pictures). The service
// around it owns the sockets and follows the master; everything here happens in its thread, and nothing here may wait.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "common/net/master_link.h"
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

}  // namespace telesplat::packer
