// The master (T3.2) without sockets and clocks: messages and times come in, messages go out. It keeps the processes,
// the epoch and the welcomes; its plan (plan.h) keeps the scene and turns views into leases.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/core/log.h"
#include "common/net/session_file.h"
#include "services/master/gate/gate.h"
#include "services/master/live/exposition.h"
#include "services/master/master_options.h"
#include "services/master/orders.h"
#include "services/master/outbox.h"
#include "services/master/peers.h"
#include "services/master/plan.h"
#include "services/master/record/run_record.h"
#include "services/master/wall/swap_barrier.h"

namespace telesplat::master {

class MasterCore {
 public:
  MasterCore(const MasterOptions& options, InstanceId instance, metrics::RunRecord& record);
  MasterCore(const MasterCore&) = delete;  // plans refer to it
  MasterCore& operator=(const MasterCore&) = delete;

  /// True if one more message of this peer may go to on(). False: drop it, the peer sends more than --max-messages.
  bool admit(const std::string& peer, double now_s);
  /// True for a data server, a packer or a sampler: the session needs them.
  bool serves(const std::string& peer) const;
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
  bool hurried() const { return !idle_.empty() && plan_->hurried(); }
  /// Time by which tick() should be called: a wall waits for a viewer that may be late. nullopt: no wall waits.
  std::optional<double> due_s() const;
  /// Sends Shutdown to every process.
  void shut_down(const std::string& reason);

  std::vector<Outgoing> take_outgoing() { return outbox_.take(); }
  size_t outgoing() const { return outbox_.size(); }
  /// Number of processes that are here or left lately, for tests.
  size_t remembered() const { return peers_.size(); }
  InstanceId instance() const { return instance_; }
  bool stop_requested() const { return stop_; }
  const std::string& stop_reason() const { return stop_reason_; }
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
  std::vector<metrics::Process> processes() const;
  std::map<std::string, double> counters() const;
  /// Returns a snapshot for programs that watch; live() has the histograms. The caller adds the version, and the master
  /// itself to the processes.
  LiveSnapshot live_snapshot() const;
  const LiveFigures& live() const { return live_; }
  Figures figures() const;  ///< sum over all plans
  /// Counts and limits of the control socket, for status.
  struct Door {
    uint64_t messages_rejected = 0, keys_refused = 0, connections_refused = 0, queue_refused = 0;
    uint64_t max_connections = 0;  ///< a limit, as is queue_limit_mb
    double queue_limit_mb = 0;
  };
  void tell_door(const Door& door) { door_ = door; }
  bool progressive() const { return plan_->progressive(); }
  std::string animation() const { return plan_->animation(); }
  /// Values as all processes get them: those that depend on the kind of scene are decided.
  uint64_t octree_depth() const { return options_.octree_depth; }
  wire::SessionSettings settings() const { return scene_as_told().settings; }

 private:
  struct Peer {
    wire::Hello hello;
    metrics::Process process;
    std::deque<std::map<std::string, double>> reports;  ///< the newest few, for rates
    double seen_s = 0;
    uint64_t joined = 0;  ///< rises with each process that joins or comes back
    bool gone = false;
    bool refused = false;                   ///< true for a data server whose scene cannot be shown
    std::optional<CouplingOrder> coupling;  ///< ordered for this viewer; nullopt: not ordered
    int leases_at_once = 0;                 ///< for samplers: see Idle::Sampler::at_once
    Pace hello_pace{8, 4};               ///< burst for new facts; then the rate of a process that waits for its welcome
    std::optional<wire::Hello> put_off;  ///< newest hello, while hello_pace allows no more
    double probed_s = -1e9;              ///< when an overdue lease last had it probed
  };
  // Processes that take part.
  Peer* known(const std::string& peer, double now_s);
  Peer* known_sampler(const std::string& peer, double now_s);
  /// Routing id of the packer that has been here for longest; others wait for it to leave. Empty: no packer is here.
  std::string packer() const;
  void follow_packer();
  void follow_another_packer(double now_s);
  bool samplers_here() const;
  /// Returns the roles that the session needs and no process has, such as "data,sampler".
  std::string lacks() const;
  bool make_room(const std::string& peer);
  void refuse(const std::string& peer, const wire::Hello& m, const std::string& why, double now_s);
  void forget_departed(double now_s);
  void forget(const Peer& peer, const std::string& routing_id);
  void replace_namesakes(const std::string& peer, const wire::Hello& m, double now_s);
  void take_put_off_hellos(double now_s);
  void adopt_refused(double now_s);
  Peer& enter(const std::string& peer, const wire::Hello& m, double now_s);
  void forget_viewer(const wire::Hello& hello);
  void lose(Peer& peer, const std::string& routing_id, const char* why, bool said_goodbye = false);

  // The scene and its epochs.
  Plan& plan_of(const wire::Hello& data);
  Status adopt_scene(const std::string& peer, const wire::Hello& data, double now_s);
  wire::Welcome scene_as_told() const;
  wire::Welcome welcome(const Peer& to, double now_s) const;
  void add_endpoints(wire::Welcome& welcome) const;
  void announce(double now_s);
  void announce_soon(double now_s);
  void next_epoch(double now_s);
  void record_epoch(double now_s);
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
  void join(const std::string& sampler, double now_s);
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
  std::map<scene::Pipeline, std::unique_ptr<Plan>> plans_;
  Plan* plan_;  // the plan in plans_ that leads
  Clipping clipping_;
  Errands errands_;
  std::optional<scene::Kind> kind_;  // kind of the scene; nullopt: unknown
  bool scene_known_ = false;
  EpochId epoch_{1};
  std::map<std::string, Peer> peers_;                      // by routing id
  std::unordered_map<InstanceId, std::string> instances_;  // routing ids, by instance
  Namesakes namesakes_;
  Departed departed_;
  std::string shows_;  // routing id of the data server whose scene is shown
  uint64_t joined_ = 0;
  std::string leading_packer_;  // packer of the frames; empty: no packer yet, or it is gone
  Idle idle_;
  LiveFigures live_;
  std::map<std::string, SwapBarrier> walls_;  // by the name that their viewers send
  SwapBarrier::Figures swaps_;                // sums over walls that are gone
  uint64_t leases_expired_ = 0;
  log::RateLimiter refused_tiles_;  // limits log lines about refused tiles
  double leases_rest_until_s_ = -1e9;
  Pace announcements_{8, 20};
  bool announce_due_ = false;
  bool data_left_ = false;  // a data server left since the last tick
  std::string told_lacks_;  // lacks() in the last welcome to everyone
  double now_s_ = 0;        // time of the last tick or SwapReady
  bool stop_ = false;
  std::string stop_reason_ = "the session was ended";
};

}  // namespace telesplat::master
