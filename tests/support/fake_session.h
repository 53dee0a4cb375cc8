// The server side of a session as one thread: a master that answers every view request and a packer that sends the
// answers' data, so that tests of viewers control every message.
#pragma once

#include <atomic>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "common/net/socket.h"
#include "common/volume/grid.h"

namespace telesplat::test {

class FakeSession {
 public:
  struct Options {
    bool volume = true;
    int coarse_patches = 0;  ///< for points: parts published before the first part of full resolution
    /// Numbers of requests (1, 2, ...) whose first answer is damaged, or left out.
    std::set<uint64_t> damaged, forgotten;
    uint64_t epoch_every = 0;  ///< a new epoch after N answers; 0: never
    /// A new master after N answers: requests are lost, frames numbered anew; 0: never.
    uint64_t restart_after = 0;
    bool taken = false;  ///< the new master knows the viewer's instance as another process'
    /// The scene becomes one of the other kind after every N answers, `changes` times; 0: never. Another packer packs
    /// it, at the same endpoints; requests are lost.
    uint64_t change_every = 0, changes = 2;
    /// After N answers the master sends a box that no model can have, and another packer begins; 0: never.
    uint64_t strange_after = 0;
    /// For points: after N answers a mark has the digest of another model than the published one; 0: never.
    uint64_t other_digest_after = 0;
    wire::SessionSettings settings{.steering = false};  ///< in the welcome
    /// Number of answers -> settings from then on.
    std::map<uint64_t, wire::SessionSettings> settings_after;
    /// Number of answers -> seconds of silence from then on.
    std::map<uint64_t, double> silent_after_s;
  };
  FakeSession(net::Context& context, const Options& options, std::string name);
  ~FakeSession();

  const std::string& master() const { return master_endpoint_; }
  /// Returns values of frames.csv that arrived, by the column's name.
  std::vector<double> column(const std::string& table, const std::string& name) const;
  std::map<std::string, double> status() const;

  struct Counts {
    uint64_t requests = 0, repeated = 0;  ///< view requests, and those whose id was known
    uint64_t most_open = 0;               ///< most requests open at a time
    uint64_t most_unacknowledged = 0;     ///< most volume frames on their way at a time
    uint64_t introductions = 0, acknowledged = 0, damaged = 0;
    uint64_t began_anew = 0;  ///< state requests that ask for everything
    bool rising = true;       ///< acknowledgements came in the order of frames
    uint64_t buffers = 0;
    bool in_order = false;
  };
  Counts counts() const;

 private:
  void loop();
  void receive_master();
  void receive_state();
  void answer_next();
  bool disturb();
  void begin_packer();
  void change_kind();
  void send_slices(const wire::ViewRequest& request);
  void publish_points(const wire::ViewRequest& request);
  wire::Welcome welcome() const;

  Options options_;
  volume::Grid grid_;
  std::string master_endpoint_, state_endpoint_, patches_endpoint_;
  net::Socket master_, state_, patches_;
  std::string viewer_, viewer_state_, former_state_;  // routing ids
  std::deque<wire::ViewRequest> open_;
  std::set<uint64_t> seen_, unacknowledged_;
  uint64_t frame_ = 0, sequence_ = 0, answers_ = 0, last_acknowledged_ = 0, buffers_ = 1;
  EpochId epoch_{1};
  InstanceId master_id_{11}, packer_{12}, viewer_id_, taken_id_;
  bool strange_ = false;
  double silent_until_s_ = 0;
  std::vector<std::pair<std::string, std::string>> log_;  // published events: type, body

  mutable std::mutex mutex_;
  Counts counts_;
  std::map<std::string, wire::MetricRows> tables_;
  std::map<std::string, double> status_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace telesplat::test
