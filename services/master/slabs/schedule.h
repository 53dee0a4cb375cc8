// View requests -> sampling frames of a volume -> a slice lease for each slab (T4.5, T7.4). Every sampler of a
// partition has a part in every frame, so there is nothing to steal and no backups: a frame that loses a sampler is
// dropped, and its views wait again. No sockets, no clocks.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/volume/shear.h"
#include "common/wire/messages.h"
#include "services/master/slabs/partition.h"
#include "services/master/views.h"

namespace telesplat::master {

// Decides which views of a wall's viewers are sampled together, and when: views that were asked for of one head
// (Swap::ask) are one frame. A viewer that is late, stopped or gone does not hold up the others. No sockets, no clocks.

class WallViews {
 public:
  /// Views that viewers ask for together come within this time. A frame begins without later ones.
  static constexpr double kTogether_s = 0.03;
  /// Time from a wall's first view until its views begin, if not all of its viewers ask sooner.
  static constexpr double kGather_s = 1;
  /// A viewer whose view belongs to no frame of the others gets a frame of its own after this time.
  static constexpr double kLeftOver_s = 0.25;
  /// A viewer that was late is waited for again after this many views in time.
  static constexpr int kInTime = 3;

  /// Returns a viewer's first view that waits; null: no view waits.
  using Waiting = std::function<const wire::ViewRequest*(InstanceId viewer)>;

  /// True for views that this class handles: asynchronous views of a wall's viewers.
  static bool concerns(const wire::ViewRequest& view) { return !view.wall.empty() && view.buffers == 0; }
  /// Takes a view that concerns() and was asked for at moments.received_s.
  void on(const wire::ViewRequest& view);
  void forget(InstanceId viewer);
  bool empty() const { return walls_.empty(); }
  /// True if a frame may begin with this view, which waits and concerns(), and with all others of together().
  bool ready(const wire::ViewRequest& view, const Waiting& waiting, double now_s) const;
  /// True if another view that waits belongs to the frame that begins with `first`. Precondition: both concerns().
  static bool together(const wire::ViewRequest& first, const wire::ViewRequest& other) {
    return other.wall == first.wall && other.ask == first.ask;
  }
  /// A frame of these views began. Precondition: the first one concerns() and was ready().
  void begun(const std::vector<wire::ViewRequest>& views);
  /// The frame of these views was dropped: they belong together again.
  void dropped(const std::vector<wire::ViewRequest>& views);

 private:
  struct Member {
    bool waited_for = true;
    int in_time = 0;                // views in a row, while it is not waited for
    std::optional<double> since_s;  // since then it waits for a frame
  };
  struct Wall {
    uint64_t viewers = 1;
    double first_s = 0;      // time of its first view
    uint64_t ask = 0;        // newest number of a head asked for
    double since_s = 0;      // when the first view of `ask` came
    bool begun = false;      // the frame of `ask` began
    bool under_way = false;  // any frame began
    std::map<InstanceId, Member> members;
  };
  std::map<std::string, Wall> walls_;
};

inline constexpr double kSameEye_m = 0.02;       ///< views from eyes that are no farther apart are sampled as one
inline constexpr double kLongestLease_s = 60.0;  ///< limit, however slow samplers are

/// Returns the frame that shows `requests` (at least one, seen from the first one's eye). If nothing of the grid is in
/// view: a raster of one pixel that looks past the grid, and one layer of one slice, so that the request is answered
/// with an empty picture at hardly any cost.
volume::ShearFrame plan(const volume::Grid& grid, const std::vector<wire::ViewRequest>& requests, int layers);

class VolumeSchedule : public Views {
 public:
  /// Uses frames_in_flight, lease_timeout_s and longest_fetch_s of the options.
  explicit VolumeSchedule(const ScheduleOptions& options) : Views(options) {}

  /// Set grid and layers of frames that begin from now on.
  void set_grid(const volume::Grid& grid) { grid_ = grid; }
  void set_layers(int layers) { layers_ = layers; }
  int layers() const { return layers_; }
  bool walls_here() const { return !walls_.empty(); }  ///< viewers of walls ask for views

  void request_view(const wire::ViewRequest& request) override;
  void forget_viewer(InstanceId viewer) override;

  /// Begins the frame of the next view that waits, and of the first view of every other viewer whose eye is within
  /// kSameEye_m of its. Views of a wall's viewers begin together (WallViews). Viewers take turns; turns_only: only
  /// those that have a turn. False: no view waits, or only views of a wall that wait for others; as many frames are
  /// in flight as views_at_once() allows; or frames of another partition are, so that all of a viewer's views become
  /// complete in order.
  bool begin_frame(EpochId epoch, std::shared_ptr<const Partition> partition, bool turns_only = false,
                   double now_s = 0);

  /// Leases the slab of `sampler` in the oldest frame that still needs it. nullopt: no frame needs it.
  std::optional<wire::SliceLease> lease(const std::string& sampler, double now_s);
  /// Gives a lease of this sampler its full time again, until longest_fetch_s after it was leased (a lease without
  /// extensions if that is longer). Others are ignored.
  void extend(LeaseId lease, const std::string& sampler, double now_s);
  /// The packer cannot use this sampler's slab image: the frame ends, and its viewers ask again when they want to.
  void refused(const wire::TileRefused& refused, const std::string& sampler);
  /// The packer has this slab. True the first time; false for duplicates, slabs never leased and unknown frames.
  bool tile_done(const wire::TileDone& tile, double now_s);

  /// Drops the frames of leases that ran out; leases then last twice as long, until a frame is complete. Calls
  /// lost_sampler with each of their samplers. Returns the number of leases that ran out.
  int expire(double now_s, const std::function<void(const std::string&)>& lost_sampler);
  /// A sampler is gone: drops the frames that lack its slab. Returns the number of its leases that were out.
  int release_sampler(const std::string& sampler);
  /// Drops all frames (new epoch, new packer). Their views wait again; of asynchronous viewers only if no newer request
  /// does.
  void drop_frames();

  size_t leases_of(const std::string& sampler) const;
  /// Samplers that have had a lease for longer than three typical slab times: they may be dead.
  std::vector<std::string> overdue(double now_s) const;
  size_t frames_in_flight() const { return frames_.size(); }
  uint64_t given_up() const { return given_up_; }  ///< frames that ended since a slab could not be used
  uint64_t slabs_released() const { return released_; }
  /// Seconds after which a lease expires now: lease_timeout_s, or four typical slab times if that is more; doubled each
  /// time leases ran out.
  double lease_time_s() const;

 private:
  struct SlabState {
    enum class State { kOpen, kLeased, kDone } state = State::kOpen;
    LeaseId lease;
    double leased_s = 0, expires_s = 0;
  };
  struct Frame {
    FrameId id;
    EpochId epoch;
    std::shared_ptr<const Partition> partition;
    volume::ShearFrame shear;
    std::vector<wire::ViewRequest> requests;
    std::vector<SlabState> slabs;
  };
  bool wait_for_others(InstanceId viewer, double now_s) const;
  bool in_one_frame(const wire::ViewRequest& first, const wire::ViewRequest& other) const;
  /// Drops frames for which lost() is true; returns the number of their leases that were out.
  int drop_where(const std::function<bool(const Frame&)>& lost);

  volume::Grid grid_;
  int layers_ = 16;
  std::deque<Frame> frames_;
  WallViews walls_;
  RunningMean slab_time_s_{0.1};  // lease -> done
  double patience_ = 1;
  uint64_t released_ = 0, given_up_ = 0;
};

}  // namespace telesplat::master
