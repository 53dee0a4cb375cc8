// The master (T3.2) without sockets and clocks: messages and times come in, messages go out.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <vector>

#include "common/metrics/run_record.h"
#include "common/wire/serial.h"
#include "services/master/frame_schedule.h"

namespace telesplat::master {

struct MasterOptions {
  ScheduleOptions schedule;
  uint64_t octree_depth = 6;
  std::map<std::string, double> settings;  ///< packing.* values for the packer, passed on in every welcome
  double silent_after_s = 5.0;             ///< a process that reports nothing for so long is taken for dead
};

/// A message to send: peer is the routing id on the control socket.
struct Outgoing {
  std::string peer, type, body;
};

class MasterCore {
 public:
  MasterCore(const MasterOptions& options, InstanceId instance, metrics::RunRecord& record);

  void on(const std::string& peer, const wire::Hello& m, double now_s);
  void on(const std::string& peer, const wire::StatusReport& m, double now_s);
  void on(const std::string& peer, const wire::ViewRequest& m, double now_s);
  void on(const std::string& peer, const wire::LeaseRequest& m, double now_s);
  void on(const std::string& peer, const wire::LeaseExtend& m, double now_s);
  void on(const std::string& peer, const wire::TileDone& m, double now_s);
  void on(const std::string& peer, const wire::Goodbye& m, double now_s);
  void on(const std::string& peer, const wire::Control& m, double now_s);
  /// Errors are the sender's fault: the caller counts them.
  Status on(const std::string& peer, const wire::MetricRows& m, double now_s);

  /// A message to this peer could not be delivered: it is gone.
  void undeliverable(const std::string& peer);
  /// To be called every 50 ms or so: expires leases, notices the dead.
  void tick(double now_s);
  /// Tells everyone to finish.
  void shut_down(const std::string& reason);

  std::vector<Outgoing> take_outgoing();
  bool stop_requested() const { return stop_; }
  /// True once everyone who was told to finish has said goodbye.
  bool everyone_left() const;

  std::vector<metrics::Process> processes() const;
  std::map<std::string, double> counters() const;

 private:
  struct Peer {
    wire::Hello hello;
    metrics::Process process;
    double seen_s = 0;
    bool gone = false;
    int waiting_leases = 0;
  };
  template <class M>
  void emit(const std::string& peer, const M& m) {
    outgoing_.push_back({peer, std::string(M::kName), wire::encode(m)});
  }
  Peer* known(const std::string& peer, double now_s);
  Peer* find_role(const std::string& role);
  wire::Welcome welcome(double now_s) const;
  void announce(double now_s);
  void dispatch(double now_s);
  void lose(Peer& peer, const std::string& routing_id, const char* why, bool said_goodbye = false);
  std::string status_json(double now_s) const;

  MasterOptions options_;
  InstanceId instance_;
  metrics::RunRecord& record_;
  FrameSchedule schedule_;
  EpochId epoch_{1};
  std::map<std::string, Peer> peers_;  // by routing id
  std::deque<std::string> idle_;       // samplers waiting for a lease, one entry a request
  std::vector<Outgoing> outgoing_;
  uint64_t leases_expired_ = 0;
  bool stop_ = false;
};

}  // namespace telesplat::master
