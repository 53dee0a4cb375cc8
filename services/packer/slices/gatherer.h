// Puts the slabs of a volume's frames together and deals complete frames out to viewers, to each what its camera may
// see (T4.5.2). No sockets, no clocks. One thread.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/core/token_bucket.h"
#include "common/volume/grid.h"
#include "common/volume/slices/image.h"
#include "common/wire/messages.h"

namespace telesplat::packer {

// When the next frame may go to an asynchronous viewer, so that it does not wait behind another one on the link: from
// how long the frames before it took to be acknowledged. No sockets, no clocks.

class SlicePace {
 public:
  /// A link that needs less for what is under way holds up nobody: the next frame goes at once.
  static constexpr double kShort_s = 0.05;
  /// Of the time that the frames under way should need, what passes before the next one follows. Less than all of it,
  /// so that the link is never idle, and that a rate that was taken for too low is found to be higher.
  static constexpr double kShare = 0.8;
  static constexpr double kWindow_s = 5;  ///< for the highest rate, and the window before
  /// Two acknowledgements that are nearer than this were read together.
  static constexpr double kLeast_s = 0.002;

  /// Bytes a second that are wished at most; 0: no wish.
  void set_most(double bytes_s) { wished_ = bytes_s; }

  /// Times never fall.
  void sent(FrameId frame, uint64_t bytes, double now_s);
  /// Frames that were not sent change nothing.
  void acknowledged(FrameId frame, double now_s);
  /// What is under way is lost, or seems to be: it is sent again. The rate stays known; what is sent twice tells
  /// nothing of it, for the first copy may be acknowledged.
  void lost() { under_way_.clear(); }

  /// The next frame may go out then; in the past: at once.
  double next_s() const { return std::max(link_free_s(), wish_s_); }
  /// As far as the wished rate goes.
  double wished_s() const { return wish_s_; }
  /// What the link carried at most, in the last 5 to 10 s; 0: not known.
  double rate_bytes_s() const { return std::max(most_, before_); }

 private:
  struct Sent {
    FrameId frame;
    uint64_t bytes;
    double sent_s;
    bool again;
  };
  double link_free_s() const;

  std::deque<Sent> under_way_;                   // oldest first
  FrameId newest_;                               // that was sent
  double last_s_ = 0;                            // acknowledgement
  double most_ = 0, before_ = 0, window_s_ = 0;  // bytes a second; in this window and the one before; its begin
  double wished_ = 0, wish_s_ = 0;               // a link of the wished rate would be done by then
};

inline constexpr size_t kMaxOpenVolumeFrames = 8;        ///< unfinished ones remembered; then the oldest is dropped
inline constexpr size_t kMaxOpenVolumeBytes = 1u << 30;  ///< all unfinished ones together
inline constexpr size_t kMaxClosedFrames = 256;          ///< complete ones remembered, to tell duplicates
inline constexpr size_t kMaxSliceViewers = 256;
/// A viewer that was sent something and acknowledges nothing for this long is forgotten.
inline constexpr double kViewerPatience_s = 10;
/// A frame that is not acknowledged for so many times what its link should need, and kViewerPatience_s, seems lost. The
/// newest frame is sent then, once.
inline constexpr double kLostAfter = 4;
/// Images are kept this far beyond a camera's edges, as a part of its width and height.
inline constexpr double kViewMargin = 0.1;

class SliceGatherer {
 public:
  /// A slab as it came. data of `images` points to memory that `owner` keeps alive.
  struct Slab {
    wire::SliceImages images;
    std::shared_ptr<const void> owner;
  };
  /// A frame for a viewer. frame.data points into `bytes`; packer and moments.published_s are the service's to
  /// fill in.
  struct Outgoing {
    std::string peer;  ///< of the socket on which the viewer acknowledges
    wire::SliceFrame frame;
    std::shared_ptr<const std::vector<uint8_t>> bytes;
  };
  struct Added {
    bool is_new = false;          ///< false: it was here already
    bool frame_complete = false;  ///< it was the last one lacking
    uint64_t blocks = 0;          ///< coded blocks in it
  };
  struct Statistics {
    uint64_t slabs = 0;            ///< taken
    uint64_t slabs_duplicate = 0;  ///< dropped: was here already
    uint64_t slabs_other_epoch = 0;
    uint64_t slabs_refused = 0;  ///< dropped: contradict themselves or their frame, or cannot be decoded
    uint64_t frames_complete = 0;
    uint64_t frames_dropped = 0;  ///< never completed
    uint64_t frames_sent = 0;     ///< to viewers, each counted
    uint64_t frames_skipped = 0;  ///< a newer one was there before the viewer was ready for them
    uint64_t viewers_forgotten = 0;
  };

  /// The volume that frames are of and the epoch that is shown. With another one unfinished frames are dropped, and
  /// newcomers get none of the old complete ones; who waits for such a frame still gets it.
  void set_scene(const volume::Grid& grid, EpochId epoch);
  bool ready() const { return grid_.has_value(); }
  EpochId epoch() const { return epoch_; }
  /// Frames are numbered anew (another master), or are of another volume. Viewers stay known; nothing is under way to
  /// them any more.
  void clear_frames();

  /// Bytes a second to each viewer that are wished at most; 0: no wish.
  void set_most(double bytes_s);

  /// Takes a slab; the last one that its frame lacked makes the frame ready for take_outgoing(). Error: lease or images
  /// make no sense, or contradict the frame's other slabs; nothing has changed then. Precondition: ready().
  Result<Added> add(Slab slab, double now_s);
  /// The frame that add() has just completed is packed, at this moment of the master's clock.
  void packed(double master_s);
  /// A viewer is there (frame 0), or has let a frame go. One that was there before and now speaks over another
  /// connection gets what was under way to it once more; over the same one frame 0 is a sign of life, since nothing is
  /// lost on it. One that comes late gets the newest complete frame, unless it wants its own in order. A frame that it
  /// could not decode is looked at (take_refused()). Error: a number of buffers beyond its limits.
  Status acknowledged(const std::string& peer, const wire::SliceAck& ack, double now_s);
  /// Slabs that cannot be decoded, of frames that viewers say to be damaged: each once.
  std::vector<wire::TileRefused> take_refused() { return std::exchange(refused_, {}); }
  /// It could not be sent to.
  void unreachable(const std::string& peer);
  /// Forgets viewers that do not answer.
  void expire(double now_s);
  /// The next frame to send: in order for each viewer, never more unacknowledged than it has buffers, and to an
  /// asynchronous viewer none that would wait on its link (SlicePace): a newer one takes its place. It counts as sent.
  std::optional<Outgoing> take_outgoing(double now_s);

  /// When a frame that waits for a link may go out; nothing: none waits for one.
  std::optional<double> due_s() const;

  const Statistics& statistics() const { return statistics_; }
  size_t open_frames() const { return open_.size(); }
  size_t viewers() const { return viewers_.size(); }

 private:
  /// All slabs of a frame, or those that have come.
  struct Frame {
    wire::SliceLease lease;                                 // of the first slab that came
    std::vector<Slab> slabs;                                // by their numbers; without an owner: not here yet
    std::vector<std::vector<volume::EncodedSlice>> slices;  // of each slab
    size_t missing = 0;
    size_t bytes = 0;
    wire::Moments moments;  // of the slab that completed it
    uint64_t voxels = 0;
    bool looked_at = false;  // whether its slabs can be decoded
  };
  using Frames = std::deque<std::shared_ptr<Frame>>;
  struct Waiting {
    std::shared_ptr<Frame> frame;
    wire::SliceView view;
    bool whole = false;  // the camera is another viewer's: nothing is left out
    double sent_s = 0;   // 0: it waits
    size_t bytes = 0;    // that were sent
  };
  struct Viewer {
    std::string peer;  // empty: frames are made for it, but it did not introduce itself yet
    uint64_t buffers = 1;
    bool in_order = false;
    std::deque<Waiting> unacknowledged, waiting;  // in order of frames
    FrameId newest;                               // that ever waited: older ones come too late
    double heard_s = 0;                           // or when it was first sent something since
    bool sent_again = false;                      // since it acknowledged a frame: one seemed lost
    SlicePace pace;
  };

  Status check(const wire::SliceLease& lease) const;
  Status check_beside_others(const wire::SliceLease& lease);
  Frames::iterator find_open(FrameId id);
  bool is_here(const wire::SliceLease& lease);
  /// The frame's entry among the open ones, made if `lease` is of its first slab. bytes: of the slab.
  std::shared_ptr<Frame> frame_of(const wire::SliceLease& lease, size_t bytes);
  void drop(Frames::iterator frame);
  void make_room(size_t bytes);
  void complete(const std::shared_ptr<Frame>& frame, double now_s);
  void look_at(Frame& frame, double now_s);
  Viewer& viewer(InstanceId id, double now_s);
  static bool seems_lost(const Viewer& viewer, double now_s);
  static bool has_room(const Viewer& viewer);
  static double may_send_s(const Viewer& viewer);
  void queue(Viewer& viewer, Waiting waiting);
  Outgoing make(InstanceId id, const Viewer& viewer, const Waiting& waiting) const;

  std::optional<volume::Grid> grid_;
  EpochId epoch_;
  double most_bytes_s_ = 0;  // wished
  Frames open_;              // oldest first
  std::deque<FrameId> closed_;
  std::shared_ptr<Frame> completed_;  // the last one
  std::shared_ptr<Frame> newest_;     // complete
  std::map<InstanceId, Viewer> viewers_;
  InstanceId turn_;  // the viewer served last
  TokenBucket looks_{4, 4};
  std::vector<wire::TileRefused> refused_;
  Statistics statistics_;
};

}  // namespace telesplat::packer
