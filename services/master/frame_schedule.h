// View requests -> sampling frames -> tile leases (T7.3): leases are pulled by idle samplers, expire, and are handed out again;
// a tile is done only when the packer has it. No sockets, no clocks.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "common/wire/messages.h"

namespace telesplat::master {

struct ScheduleOptions {
  int tile_size = 256;       ///< pixels a side; the last column and row may be smaller
  int frames_in_flight = 2;  ///< frames begun and not complete, at most
  double lease_timeout_s =
      2.0;  ///< longest time before a lease goes to another sampler; shorter once tile times are known
};

/// Cuts a frame into tiles of tile_size, those nearest the centre first (that is where the person looks).
std::vector<geometry::Rect> cut_tiles(int width, int height, int tile_size);

class FrameSchedule {
 public:
  explicit FrameSchedule(const ScheduleOptions& options) : options_(options) {}

  /// The newest request of a viewer replaces the one that waits.
  void request_view(const wire::ViewRequest& request);
  void forget_viewer(InstanceId viewer);

  /// The next tile to sample, leased to `sampler`, or nothing if no tile is open and no view waits.
  std::optional<wire::Lease> lease(const std::string& sampler, EpochId epoch, double now_s);
  /// Gives a lease its full time again. Unknown leases are ignored.
  void extend(LeaseId lease, double now_s);
  /// The packer has this tile. Returns true the first time, false for duplicates and unknown frames.
  bool tile_done(FrameId frame, uint64_t tile, double now_s);

  /// Takes back leases that ran out. Returns how many; lost_sampler is told whose.
  int expire(double now_s, const std::function<void(const std::string&)>& lost_sampler);
  /// Takes back all leases of a sampler that left. Returns how many.
  int release_sampler(const std::string& sampler);
  size_t leases_of(const std::string& sampler) const;
  /// Drops all frames (new epoch, new packer); waiting view requests stay.
  void drop_frames();

  bool view_waiting() const { return !waiting_.empty(); }
  bool tile_open() const;
  size_t frames_in_flight() const { return frames_.size(); }
  uint64_t frames_completed() const { return completed_; }
  uint64_t tiles_released() const { return released_; }
  /// Seconds after which a lease expires now: 25 typical tile times, within [0.3, lease_timeout_s].
  double lease_time_s() const;

 private:
  enum class State { kOpen, kLeased, kDone };
  struct Tile {
    geometry::Rect rect;
    State state = State::kOpen;
    LeaseId lease;
    std::string sampler;
    double leased_s = 0, expires_s = 0;
  };
  struct Frame {
    FrameId id;
    EpochId epoch;
    wire::ViewRequest request;
    std::vector<Tile> tiles;
    size_t done = 0;
  };
  bool begin_frame(EpochId epoch);

  ScheduleOptions options_;
  std::map<InstanceId, wire::ViewRequest> waiting_;
  InstanceId last_viewer_;  // viewers take turns
  std::deque<Frame> frames_;
  FrameId next_frame_{1};
  LeaseId next_lease_{1};
  double tile_time_s_ = 0;  // running mean of lease -> done
  uint64_t completed_ = 0, released_ = 0;
};

}  // namespace telesplat::master
