// Checks of every session, made all the time: they look at the messages of the network, at the frames of viewers and at
// the reports of processes. A check that fails ends the session.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tools/lab/simulation/order_checks.h"
#include "tools/lab/simulation/session.h"

namespace telesplat::simulation {

/// The names of the checks, as failures tell them.
inline constexpr std::string_view kCheckNames[] = {
    "replica",    // a replica is not the packer's model by its digest
    "behind",     // a viewer does not have all that was published though its network has been quiet
    "request",    // a view request does not end in time
    "twice",      // a tile or an update is published twice
    "lease",      // a lease is lost, or outlives its master
    "backwards",  // a display goes back to an older update or epoch
    "blank",      // a display has no picture though it had one
    "limit",      // a model, a log or a queue is larger than its limit
    "standing",   // a standing head sees holes or errors, or its rays go on
    "order",      // an order gets no answer, is not carried out, or not refused though it is wrong
    "scene",      // the session shows another scene than its data servers have
    "intruder",   // a process whose key is not of its role is told anything of the session, or goes on
    "rejected",   // a process rejects a message that none of ours may send
    "exit",       // a process ends that nothing told to end
    "record",     // an update is not in the record once
};

struct Failure {
  std::string check, text;
  double at_s = 0;
};

/// The figures of a session, the same for the same scenario.
struct Figures {
  uint64_t digest = 0;  ///< digest of all delivered messages with their times, and of all frames
  uint64_t messages = 0, frames = 0, updates = 0, turns = 0;
  uint64_t leases = 0, rays = 0;   ///< leases of tiles, and the rays that they name
  uint64_t bytes = 0, points = 0;  ///< sent to viewers; of the packer's model at the end
  double waited_s = 0;             ///< for all `updates`, each from the request that it answers
  double holes = 0, psnr_db = 0;   ///< last frame of viewer 0 against the truth; -1: not known
};
struct Outcome : Figures {
  std::optional<Failure> failure;
};

/// A picture beside the truth, whose sides are kFine times as long.
inline constexpr int kFine = 4;
struct Compared {
  double holes = 0, wrong = 0, psnr_db = 0;
  uint64_t whole = 0;
};
Compared compare(const image::View& view, const image::View& truth);

class Checks final : public Observer {
 public:
  explicit Checks(const Scenario& scenario);

  void on_passed(const Passed& message) override;
  void on_event(const Event& event) override;
  void on_begin(Part part, int process, double now_s) override;
  void on_end(Part part, int process, double now_s, const std::string& how) override;
  void on_frame(Part part, SimulatedViewer& viewer, const viewer::DrawnFrame& drawn, double now_s) override;
  void on_rejected(Part part, std::string_view socket, const net::Message& message, const std::string& why) override;
  void on_unexpected(Part part, const std::string& what, double now_s) override;

  /// To be called at the end of the calm, before the session ends.
  void at_rest(Session& session);
  /// To be called when the session has ended. folder: of its record; empty: none.
  void at_end(const std::string& folder, double now_s);
  Outcome& outcome() { return outcome_; }
  /// Is called with the first failure.
  std::function<void()> on_failure;

 private:
  struct Viewer {  // a life of one
    int process = -1;
    InstanceId instance;
    std::map<uint64_t, double> open;     // requests, when they were sent
    std::optional<double> open_since_s;  // some request has been open since then, and none was answered
    uint64_t shown = 0, epoch = 0;       // request of the newest update that was shown
    bool pictured = false, another_master = false;
    std::map<std::string, double> status;
    double digests_equal_at_calm = -1;
  };
  void fail(std::string_view check, const std::string& text, double now_s);
  void digest(const Passed& m);
  void digest(const viewer::DrawnFrame& drawn, const image::View& view);
  void sent(const Passed& m);
  void delivered(const Passed& m);
  void on_patch(const Passed& m, Part from);
  void on_updates(const wire::MetricRows& rows, Part part);
  void note_sequence(uint64_t sequence, double now_s);
  void on_lease(const wire::Lease& lease);
  void on_done(const wire::TileDone& done, double now_s);
  void on_status(const Passed& m, Part part);
  void answered(int process, InstanceId viewer, RequestId request, double now_s);
  void look_at_requests(double now_s);
  void look_at_late_rays(const Session& session);
  void look_at_status(const Session& session);
  void compare_pictures(Session& session);
  bool has_strangers() const { return excuses_.has({Fault::kStranger, Fault::kImpostor}); }
  Viewer* viewer_of(int process);
  bool is_newest_master(int process) const;

  const Scenario scenario_;
  const Excuses excuses_;
  OrderChecks orders_;
  Outcome outcome_;
  std::map<int, Part> parts_;                                 // by process
  std::map<int, Viewer> viewers_;                             // by process
  std::map<std::pair<uint64_t, uint64_t>, int> published_;    // frame and tile, of this packer and master
  std::map<uint64_t, std::pair<uint64_t, uint64_t>> leases_;  // lease: frame and tile, of this master
  std::set<std::pair<uint64_t, uint64_t>> updates_;           // rows of updates that viewers sent
  std::set<int> intruders_;                                   // that run
  std::set<std::string> intruder_keys_;
  std::map<std::string, double> packer_;  // its newest status
  double looked_s_ = 0, now_s_ = 0;
  uint64_t late_rays_ = 0;
  std::deque<std::pair<double, uint64_t>> sequences_;  // that the packer had, and when
  uint64_t rows_ = 0;                                  // rows of updates that came to the master
  bool rests_ = false, packer_welcomed_ = false;
};

}  // namespace telesplat::simulation
