// The master (T3.2) without sockets and clocks: messages and times come in, messages go out.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/metrics/run_record.h"
#include "common/wire/serial.h"
#include "services/master/slabs/partition.h"
#include "services/master/slabs/scene.h"
#include "services/master/slabs/schedule.h"
#include "services/master/tiles/frame_schedule.h"
#include "services/master/tiles/julia_parameters.h"

namespace telesplat::master {

/// Whether a view arrives coarse first.
enum class Progressive {
  kAuto,  ///< of scenes that take long to sample: Julia sets
  kOn,
  kOff
};

/// As --progressive takes it.
const char* name_of(Progressive progressive);

struct MasterOptions {
  ScheduleOptions schedule;
  Progressive progressive = Progressive::kAuto;
  julia::Timeline animation;  ///< of the scene's parameters, from the first view on; empty: what the data server says
  uint64_t octree_depth = 0;  ///< 0: MasterCore::octree_depth
  std::map<std::string, double> settings;  ///< packing.* values for the packer, passed on in every welcome;
                                           ///< packing.keep_redundant below 0: 1 for Julia sets, else 0;
                                           ///< volume.layers: of a volume's frames
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
  void on(const std::string& peer, const wire::SlabReady& m, double now_s);
  /// Errors are the sender's fault: the caller counts them.
  Status on(const std::string& peer, const wire::MetricRows& m, double now_s);
  Status on(const std::string& peer, const wire::SliceWeights& m, double now_s);

  /// A message to this peer could not be delivered: it is gone.
  void undeliverable(const std::string& peer);
  /// To be called every 50 ms or so: expires leases, notices the dead.
  void tick(double now_s);
  /// Samplers idle while tiles are out: a backup may soon be due, so tick() should come every few ms.
  bool hurried() const { return !volume_on_ && !idle_.empty() && schedule_.frames_in_flight() > 0; }
  /// Tells everyone to finish.
  void shut_down(const std::string& reason);

  std::vector<Outgoing> take_outgoing();
  bool stop_requested() const { return stop_; }
  /// True once everyone who was told to finish has said goodbye.
  bool everyone_left() const;

  std::vector<metrics::Process> processes() const;
  std::map<std::string, double> counters() const;
  bool progressive() const { return schedule_.cut().coarse; }
  std::string animation() const;
  /// MasterOptions::octree_depth, and settings as the packer gets them: what was left to the kind of scene is decided.
  uint64_t octree_depth() const;
  std::map<std::string, double> settings() const;

 private:
  struct Peer {
    wire::Hello hello;
    metrics::Process process;
    double seen_s = 0;
    bool gone = false;
    int waiting_leases = 0;  ///< lease requests not answered yet; above 0: the sampler is in idle_
    int leases_at_once = 0;  ///< a sampler's: waiting for so many it holds none; 0: it did not say
    double probed_s = -1e9;  ///< when it was last asked whether it still is there
  };
  template <class M>
  void emit(const std::string& peer, const M& m) {
    outgoing_.push_back({peer, std::string(M::kName), wire::encode(m)});
  }
  Peer* known(const std::string& peer, double now_s);
  Peer* find_role(const std::string& role);
  wire::Welcome welcome(double now_s) const;
  void announce(double now_s);
  void adopt_scene(const wire::Hello& data, double now_s);
  void next_epoch(double now_s);
  void record_epoch(double now_s);
  Result<std::string> obey(const wire::Control& m, double now_s);
  bool begin_view(double now_s);
  bool lease_one(double now_s);
  void dispatch(double now_s);
  void lose(Peer& peer, const std::string& routing_id, const char* why, bool said_goodbye = false);
  std::string status_json(double now_s) const;

  // Volumes: master_volume.cpp.
  void adopt_volume(const wire::Hello& data, double now_s);
  Result<std::string> obey_volume(const wire::Control& m, double now_s);
  void join_partition(const std::string& peer);
  void leave_partition(const std::string& peer);
  void update_partition(double now_s);
  void assign(const Partition& partition);
  bool begin_volume_frame(double now_s);
  void dispatch_volume(double now_s);
  void expire_slabs(double now_s);
  nlohmann::ordered_json volume_status() const;

  MasterOptions options_;
  InstanceId instance_;
  metrics::RunRecord& record_;
  FrameSchedule schedule_;
  SceneParameters scene_;
  bool volume_on_ = false;  // the scene is a volume, and all of it is known
  VolumeScene volume_;
  double volume_since_s_ = 0;
  SlabPartitions partitions_;
  VolumeSchedule volume_schedule_;
  bool scene_known_ = false;
  geometry::Box box_room_;  // of the last data server
  std::map<std::string, std::string> facts_;
  EpochId epoch_{1};
  std::map<std::string, Peer> peers_;                      // by routing id
  std::unordered_map<InstanceId, std::string> instances_;  // routing ids
  std::deque<std::string> idle_;                           // samplers waiting for leases, each once
  std::vector<Outgoing> outgoing_;
  uint64_t leases_expired_ = 0;
  bool stop_ = false;
};

}  // namespace telesplat::master
