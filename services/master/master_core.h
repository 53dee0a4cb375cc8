// The master (T3.2) without sockets and clocks: messages and times come in, messages go out. It knows who takes part,
// which epoch it is and what each is told; what a scene is and how its views become leases is its plan's (plan.h).
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

  /// One more message of this peer may be handed to on(): it does not send more than its part. False: it is dropped.
  bool admit(const std::string& peer, double now_s);
  /// A data server, a packer or a sampler, which the session lives of.
  bool serves(const std::string& peer) const;
  /// For all others: net::WorkShares.
  bool admit_work(const std::string& payer, double now_s) { return gate_.admit_work(payer, now_s); }
  void worked(const std::string& payer, double seconds, double now_s) { gate_.worked(payer, seconds, now_s); }
  void on(const std::string& peer, const wire::Hello& m, double now_s);
  void on(const std::string& peer, const wire::StatusReport& m, double now_s);
  /// guest: the owner of the viewer's key that let it in; empty: another key, or none.
  void on(const std::string& peer, const wire::ViewRequest& m, double now_s, const std::string& guest = {});
  void on(const std::string& peer, const wire::LeaseRequest& m, double now_s);
  void on(const std::string& peer, const wire::LeaseExtend& m, double now_s);
  void on(const std::string& peer, const wire::TileDone& m, double now_s);
  void on(const std::string& peer, const wire::TileRefused& m, double now_s);
  void on(const std::string& peer, const wire::Goodbye& m, double now_s);
  /// key: the name of the sender's key; empty: it has none.
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
  /// To be called every 50 ms or so: expires leases, notices the dead.
  void tick(double now_s);
  /// This process did not run for so long: nobody else's silence counts, and leases are given a moment to be told of.
  /// To be called before what has come meanwhile is taken.
  void stood_still(double for_s, double now_s);
  /// tick() should come every few ms.
  bool hurried() const { return !idle_.empty() && plan_->hurried(); }
  /// tick() should come then, if nothing comes before: a wall waits for a viewer that may be late. Nothing: none does.
  std::optional<double> due_s() const;
  /// Tells everyone to finish.
  void shut_down(const std::string& reason);

  std::vector<Outgoing> take_outgoing() { return outbox_.take(); }
  size_t outgoing() const { return outbox_.size(); }
  /// Processes of which anything is remembered but for the record.
  size_t remembered() const { return peers_.size(); }
  InstanceId instance() const { return instance_; }
  bool stop_requested() const { return stop_; }
  const std::string& stop_reason() const { return stop_reason_; }
  /// True once everyone who was told to finish has said goodbye.
  bool everyone_left() const;

  /// Who the session is, for status; the core adds scene and kind once they are known.
  /// run_id: of the record's folder, by which viewers know it; empty: there is none.
  void introduce(const net::RunningSession& session, const std::string& run_id = {}) {
    session_ = session;
    run_id_ = run_id;
  }
  const net::RunningSession& session() const { return session_; }
  LimitsHit limits_hit() const { return gate_.hit(); }
  std::vector<metrics::Process> processes() const;
  std::map<std::string, double> counters() const;
  /// For those who watch; what figures() and live() do not have of it is left to the caller: version, and the master
  /// itself.
  LiveSnapshot live_snapshot() const;
  const LiveFigures& live() const { return live_; }
  Figures figures() const;  ///< of all plans together
  /// What the socket counts, for status.
  struct Door {
    uint64_t messages_rejected = 0, keys_refused = 0, connections_refused = 0, queue_refused = 0;
    uint64_t max_connections = 0;  ///< its limits
    double queue_limit_mb = 0;
  };
  void tell_door(const Door& door) { door_ = door; }
  bool progressive() const { return plan_->progressive(); }
  std::string animation() const { return plan_->animation(); }
  /// As everyone is told them: what was left to the kind of scene is decided.
  uint64_t octree_depth() const { return options_.octree_depth; }
  wire::SessionSettings settings() const { return scene_as_told().settings; }

 private:
  struct Peer {
    wire::Hello hello;
    metrics::Process process;
    std::deque<std::map<std::string, double>> reports;  ///< the newest few, for rates
    double seen_s = 0;
    uint64_t joined = 0;  ///< rises with each process that joins, in whichever life
    bool gone = false;
    bool refused = false;                   ///< a data server whose scene cannot be shown
    std::optional<CouplingOrder> coupling;  ///< a viewer's, if it was ordered one
    int leases_at_once = 0;                 ///< a sampler's: Idle::Sampler::at_once
    Pace hello_pace{8, 4};                  ///< as its facts become known; then as often as one that is not welcomed
    std::optional<wire::Hello> put_off;     ///< its newest hello, if it says more than the pace allows
    double probed_s = -1e9;                 ///< when it was last asked whether it still is there
  };
  // Who takes part.
  Peer* known(const std::string& peer, double now_s);
  Peer* known_sampler(const std::string& peer, double now_s);
  /// The packer that has been here for longest: others wait for it to leave.
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
  /// all: facts are told whole.
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
  Plan* plan_;  // of these, the one that leads
  Clipping clipping_;
  Errands errands_;
  std::optional<scene::Kind> kind_;  // of its scene
  bool scene_known_ = false;
  EpochId epoch_{1};
  std::map<std::string, Peer> peers_;                      // by routing id
  std::unordered_map<InstanceId, std::string> instances_;  // routing ids
  Namesakes namesakes_;
  Departed departed_;
  std::string shows_;  // the data server that the scene is of
  uint64_t joined_ = 0;
  std::string leading_packer_;  // that frames were begun with; empty: none, or it is gone
  Idle idle_;
  LiveFigures live_;
  std::map<std::string, SwapBarrier> walls_;  // by what their viewers call them
  SwapBarrier::Figures swaps_;                // of walls that are gone
  uint64_t leases_expired_ = 0;
  log::RateLimiter refused_tiles_;  // of lines about them
  double leases_rest_until_s_ = -1e9;
  Pace announcements_{8, 20};
  bool announce_due_ = false;
  bool data_left_ = false;  // a data server, since the last tick
  std::string told_lacks_;  // lacks(), as everyone was told it
  double now_s_ = 0;        // of what came last
  bool stop_ = false;
  std::string stop_reason_ = "the session was ended";
};

}  // namespace telesplat::master
