// The master (T3.2) without sockets and clocks: messages and times come in, messages go out. It keeps the processes,
// the epoch and the welcomes; its plan (plan.h) keeps the scene and turns views into leases.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/core/log.h"
#include "common/net/session_file.h"
#include "services/master/gate/gate.h"
#include "services/master/live/exposition.h"
#include "services/master/master_options.h"
#include "services/master/orders.h"
#include "services/master/outbox.h"
#include "services/master/peers/idle.h"
#include "services/master/peers/peers.h"
#include "services/master/record/run_record.h"
#include "services/master/shown_scene.h"
#include "services/master/wall/swap_barrier.h"

namespace telesplat::master {

/// Limits how often everyone is told of the session anew. No clocks.
class Announcements {
 public:
  explicit Announcements(std::string lacks) : lacks_(std::move(lacks)) {}
  /// Something changed. True: it may be told now, else it is due.
  bool change(double now_s) {
    due_ = !pace_.allows(now_s);
    return !due_;
  }
  /// Everyone is told, and that the session lacks these roles.
  void told(std::string lacks, double now_s) {
    pace_.count(now_s);
    due_ = false;
    lacks_ = std::move(lacks);
  }
  bool due(const std::string& lacks) const { return due_ || lacks_ != lacks; }

 private:
  Pace pace_{8, 20};
  bool due_ = false;
  std::string lacks_;  // as everyone was told it
};

class MasterCore {
 public:
  MasterCore(const MasterOptions& options, InstanceId instance, metrics::RunRecord& record);
  MasterCore(const MasterCore&) = delete;  // plans refer to it
  MasterCore& operator=(const MasterCore&) = delete;

  /// True if one more message of this peer may go to on(). False: drop it, the peer sends more than --max-messages.
  bool admit(const std::string& peer, double now_s) {
    const Peer* p = peers_.here(peer);
    return (p && p->serves_as("packer")) || gate_.admit(peer, now_s);
  }
  /// True for a data server, a packer or a sampler: the session needs them.
  bool serves(const std::string& peer) const {
    const Peer* p = peers_.here(peer);
    return p && (p->serves_as("data") || p->serves_as("packer") || p->serves_as("sampler"));
  }
  /// For all other peers; see net::WorkShares.
  bool admit_work(const std::string& payer, double now_s) { return gate_.admit_work(payer, now_s); }
  void worked(const std::string& payer, double seconds, double now_s) { gate_.worked(payer, seconds, now_s); }
  void on(const std::string& peer, const wire::Hello& m, double now_s);
  void on(const std::string& peer, const wire::StatusReport& m, double now_s);
  /// guest: the owner of the viewer key that let the viewer in; empty: another kind of key, or no key.
  void on(const std::string& peer, const wire::ViewRequest& m, double now_s, const std::string& guest = {});
  void on(const std::string& peer, const wire::LeaseRequest& m, double now_s);
  void on(const std::string& peer, const wire::LeaseExtend& m, double now_s);
  void on(const std::string& peer, const wire::TileDone& m, double now_s);
  void on(const std::string& peer, const wire::TileRefused& m, double now_s);
  void on(const std::string& peer, const wire::Goodbye& m, double now_s);
  /// key: the name of the sender's key; empty: it has no key.
  void on(const std::string& peer, const wire::Control& m, double now_s, const std::string& key = {});
  void on(const std::string& peer, const wire::SlabReady& m, double now_s);
  void on(const std::string& peer, const wire::OrderAnswer& m, double now_s);
  void on(const std::string& peer, const wire::LinkReport& m, double now_s);
  /// peer: the connection over which the viewer swaps, not the one that it said hello on.
  void on(const std::string& peer, const wire::SwapReady& m, double now_s);
  /// Errors are the sender's fault: the caller counts them.
  Status on(const std::string& peer, const wire::MetricRows& m, double now_s);
  Status on(const std::string& peer, const wire::SliceWeights& m, double now_s);
  Status on(const std::string& peer, const wire::Plan& m, double now_s);

  /// A message to this peer could not be delivered: it is gone.
  void undeliverable(const std::string& peer);
  /// Expires leases and notices dead processes. To be called every 50 ms or so.
  void tick(double now_s);
  /// This process did not run for for_s: others do not count as silent for that time, and leases do not expire for
  /// kCatchUp_s. To be called before messages that came meanwhile are read.
  void stood_still(double for_s, double now_s);
  /// True if tick() should be called every few ms.
  bool hurried() const { return !idle_.empty() && plan().hurried(); }
  /// Time by which tick() should be called: a wall waits for a viewer that may be late. nullopt: no wall waits.
  std::optional<double> due_s() const;
  /// Sends Shutdown to every process.
  void shut_down(const std::string& reason);

  std::vector<Outgoing> take_outgoing() { return outbox_.take(); }
  size_t outgoing() const { return outbox_.size(); }
  /// Number of processes that are here or left lately, for tests.
  size_t remembered() const { return peers_.size(); }
  InstanceId instance() const { return instance_; }
  bool stop_requested() const { return stop_reason_.has_value(); }
  /// Precondition: stop_requested().
  const std::string& stop_reason() const { return *stop_reason_; }
  /// True once all processes except ctl have left.
  bool everyone_left() const;

  /// Sets the session's description, for status; the core adds scene and kind once they are known.
  /// run_id: id of the record's folder, by which viewers recognise it; empty: no record is written.
  void introduce(const net::RunningSession& session, const std::string& run_id = {}) {
    session_ = session;
    run_id_ = run_id;
  }
  const net::RunningSession& session() const { return session_; }
  LimitsHit limits_hit() const { return gate_.hit(); }
  std::vector<metrics::Process> processes() const { return peers_.processes(); }
  std::map<std::string, double> counters() const;
  /// Returns a snapshot for programs that watch; live() has the histograms. The caller adds the version, and the master
  /// itself to the processes.
  LiveSnapshot live_snapshot() const;
  const LiveFigures& live() const { return live_; }
  Figures figures() const { return scene_.figures(); }
  /// Counts and limits of the control socket, for status.
  struct Door {
    uint64_t messages_rejected = 0, keys_refused = 0, connections_refused = 0, queue_refused = 0;
    uint64_t max_connections = 0;  ///< a limit, as is queue_limit_mb
    double queue_limit_mb = 0;
  };
  void tell_door(const Door& door) { door_ = door; }
  bool progressive() const { return plan().progressive(); }
  std::string animation() const { return plan().animation(); }
  /// Values as all processes get them: those that depend on the kind of scene are decided.
  uint64_t octree_depth() const { return options_.octree_depth; }
  wire::SessionSettings settings() const { return scene_.describe().settings; }

 private:
  PlanLinks plan_links();

  // Processes that take part.
  Peer* known(const std::string& peer, double now_s);
  Peer* known_sampler(const std::string& peer, double now_s);
  void follow_packer();
  void follow_another_packer(double now_s);
  void refuse(const std::string& peer, const wire::Hello& m, const std::string& why, double now_s);
  void replace_namesakes(const std::string& peer, const wire::Hello& m, double now_s);
  void take_put_off_hellos(double now_s);
  void adopt_refused(double now_s);
  Peer& enter(const std::string& peer, const wire::Hello& m, double now_s);
  void forget_viewer(const wire::Hello& hello);
  void lose(Peer& peer, const std::string& routing_id, const char* why, bool said_goodbye = false);

  // The scene and its epochs.
  Plan& plan() const { return scene_.plan(); }
  Status adopt_scene(const std::string& peer, const wire::Hello& data, double now_s);
  wire::Welcome welcome(const Peer& to, double now_s) const;
  void add_endpoints(wire::Welcome& welcome) const;
  void announce(double now_s);
  void announce_soon(double now_s);
  void next_epoch(double now_s);
  Result<std::string> obey(const wire::Control& m, double now_s);
  Result<std::string> order_coupling(const wire::Control& m, double now_s);
  void answer_of_launcher(const std::string& peer, const wire::Control& m);
  Status pass_on(const Errands::Asker& asker, const wire::Control& m, const std::string& role, double now_s);
  /// all: facts are not shortened.
  nlohmann::ordered_json process_json(const std::string& routing_id, const Peer& peer, double now_s, bool all) const;
  std::string status_json(double now_s, bool all) const;
  wire::ControlReply health(const wire::Control& m, double now_s) const;

  // Walls.
  void send_swaps();

  // Leases.
  bool begin_view(double now_s);
  void dispatch(double now_s);

  MasterOptions options_;
  InstanceId instance_;
  metrics::RunRecord& record_;
  Outbox outbox_;
  Gate gate_{options_.limits};
  net::RunningSession session_;
  std::string run_id_;
  Door door_;
  Errands errands_;
  Peers peers_;
  ShownScene scene_;
  Idle idle_;
  LiveFigures live_;
  std::map<std::string, SwapBarrier> walls_;  // by the name that their viewers send
  SwapBarrier::Figures swaps_;                // sums over walls that are gone
  log::RateLimiter refused_tiles_;            // limits log lines about refused tiles
  double leases_rest_until_s_ = -1e9;
  Announcements announcements_{peers_.lacks()};
  double now_s_ = 0;                        // time of the last tick or SwapReady
  std::optional<std::string> stop_reason_;  // none: the session goes on
};

}  // namespace telesplat::master
