// View requests -> sampling frames -> leases (T7.3): leases are pulled by idle samplers, expire, and are handed out
// again; a tile is done only when the packer has it. No sockets, no clocks.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "common/wire/messages.h"
#include "services/master/tiles/frame_tiles.h"
#include "services/master/tiles/sampling_costs.h"
#include "services/master/views.h"

namespace telesplat::master {

inline constexpr double kLeastOverdue_s = 0.015;  ///< nothing that has been out for less gets a backup

/// Seconds of lease_target_s that each sampler adds at least: so master and packer have no more than 4000 leases of
/// rows a second to look after, however many samplers there are. Set by `telesplat bench scaling`: on two cores that
/// leaves the samplers' processes their part.
inline constexpr double kTargetPerSampler_s = 0.25e-3;

/// Rows that take longer are not kept in store at the end of a frame; of cheaper ones it takes longer to fetch the next
/// than to wait for one in store (3 to 8 ms between idle and busy with 40 samplers on two cores; `telesplat bench
/// scaling`).
inline constexpr double kDearRow_s = 0.01;

/// How the frames of a scene are leased.
struct Cut {
  bool rows = false;    ///< bands of rows of blocks instead of square tiles
  bool coarse = false;  ///< a view is two frames: one of step kCoarseStep, then one of step 1
  bool operator==(const Cut&) const = default;
};

class FrameSchedule : public Views {
 public:
  explicit FrameSchedule(const ScheduleOptions& options) : Views(options) {}

  /// For frames that begin from now on.
  void set_cut(Cut cut) { cut_ = cut; }
  Cut cut() const { return cut_; }

  /// Begins the frame or frames of the next view that waits; see Views::take_view(). False: there is none.
  bool begin_view(EpochId epoch, bool turns_only = false);

  /// What `sampler` should do next: an open tile of the oldest frame that has one; or a backup of a tile that has been
  /// out for long in a frame that has none (see backup_after_s()). The newest frame's last rows, one a sampler, go only
  /// to samplers that hold no other lease, if they take longer than kDearRow_s. even_own: tiles whose lease ran out at
  /// this very sampler, too. idle: it is known to hold none, though the packer may not have said so yet.
  std::optional<wire::Lease> lease(const std::string& sampler, double now_s, bool even_own = true, bool idle = false);
  /// Gives a lease its full time again. Unknown leases are ignored.
  void extend(LeaseId lease, double now_s);
  /// The packer has this tile, which `sampler` (empty: unknown) sampled. Returns true the first time, whichever lease
  /// it came from; false for duplicates, tiles never leased and unknown frames. Learns from the tile's times.
  bool tile_done(const wire::TileDone& tile, const std::string& sampler, double now_s);

  /// The sampler asked for work, so it no longer works on tiles that a backup delivered first.
  void heard_of(const std::string& sampler);
  /// Takes back leases that ran out, those that a backup was faster with included. Returns how many; lost_sampler is
  /// told whose.
  int expire(double now_s, const std::function<void(const std::string&)>& lost_sampler);
  /// Takes back all leases of a sampler that left. Returns how many.
  int release_sampler(const std::string& sampler);
  size_t leases_of(const std::string& sampler) const;
  /// Drops all frames (new epoch, new packer). Their views wait again, unless a newer request of the viewer does.
  void drop_frames();

  bool tile_open() const;
  /// A tile has been out so long that any other sampler than its own could take a backup.
  bool backup_due(double now_s) const;
  size_t frames_in_flight() const { return frames_.size(); }
  uint64_t tiles_released() const { return released_; }
  uint64_t backups() const { return backups_; }
  const SamplingCosts& costs() const { return costs_; }
  /// Seconds after which a lease expires now: 25 typical tile times, within [0.3, lease_timeout_s].
  double lease_time_s() const;
  /// Seconds after which a tile that is out may be leased to another sampler too: 3 typical tile times, at least
  /// kLeastOverdue_s; never while nothing is known.
  double backup_after_s() const;

 private:
  struct Frame {
    FrameId id;
    EpochId epoch;
    wire::ViewRequest request;
    int step = 1;
    geometry::Camera camera;
    FrameTiles tiles;
  };
  // A lease whose tile another sampler delivered first; its own may be dead or slow.
  struct Overtaken {
    std::string sampler;
    double expires_s;
  };
  FrameId begin_frame(EpochId epoch, const wire::ViewRequest& request, int step);
  void end_frame(std::deque<Frame>::iterator frame);
  wire::Lease lease_tile(Frame& frame, size_t tile, const std::string& sampler, double now_s);

  Cut cut_;
  std::deque<Frame> frames_;
  std::map<LeaseId, Overtaken> overtaken_;
  SamplingCosts costs_;
  RunningMean tile_time_s_{0.05};  // lease -> done
  uint64_t released_ = 0, backups_ = 0;
};

}  // namespace telesplat::master
