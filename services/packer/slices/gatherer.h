// Gathers the slabs of a volume's frames and hands complete frames to viewers: each viewer gets the images that its
// camera may see (T4.5.2). No sockets, no clocks. One thread.
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

// Times an asynchronous viewer's next frame so that it does not queue behind another one on the link, by the time that
// earlier frames took to be acknowledged. No sockets, no clocks.

class SlicePace {
 public:
  /// A link that needs less than this for the frames under way delays no viewer: the next frame goes at once.
  static constexpr double kShort_s = 0.05;
  /// The next frame follows after this share of the time that the frames under way should need. Less than 1, so that
  /// the link is never idle, and a rate that was estimated too low is found to be higher.
  static constexpr double kShare = 0.8;
  static constexpr double kWindow_s = 5;  ///< length of a window for the highest rate; the one before counts, too
  /// Two acknowledgements nearer than this were read together.
  static constexpr double kLeast_s = 0.002;

  /// Sets the user's limit, bytes per second; 0: no limit.
  void set_most(double bytes_s) { wished_ = bytes_s; }

  /// A frame goes out. Times never fall.
  void sent(FrameId frame, uint64_t bytes, double now_s);
  /// A frame was acknowledged; ignored if it was not sent.
  void acknowledged(FrameId frame, double now_s);
  /// The frames under way are lost, or seem to be: they are sent again. The rate stays known; frames sent twice do not
  /// count for it, since the first copy may be acknowledged.
  void lost() { under_way_.clear(); }

  /// Returns when the next frame may go out; in the past: at once.
  double next_s() const { return std::max(link_free_s(), wish_s_); }
  /// The same, by the user's limit alone.
  double wished_s() const { return wish_s_; }
  /// Highest rate of the link in the last 5 to 10 s; 0: not known.
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
  FrameId newest_;                               // the newest frame sent
  double last_s_ = 0;                            // time of the last acknowledgement
  double most_ = 0, before_ = 0, window_s_ = 0;  // bytes per second, in this and the last window; this one's begin
  double wished_ = 0, wish_s_ = 0;               // user's limit; when a link of that rate would be free
};

inline constexpr size_t kMaxOpenVolumeFrames = 8;        ///< unfinished frames held; then the oldest is dropped
inline constexpr size_t kMaxOpenVolumeBytes = 1u << 30;  ///< all unfinished frames together
inline constexpr size_t kMaxClosedFrames = 256;          ///< complete frames remembered, to recognise duplicates
inline constexpr size_t kMaxSliceViewers = 256;
/// A viewer with frames under way that acknowledges none for this long is forgotten.
inline constexpr double kViewerPatience_s = 10;
/// A frame seems lost if it is not acknowledged for this many times the time its link should need, and for
/// kViewerPatience_s. Then the newest frame is sent, once.
inline constexpr double kLostAfter = 4;
/// Images are kept this far beyond a camera's edges, as a fraction of its width and height.
inline constexpr double kViewMargin = 0.1;

class SliceGatherer {
 public:
  /// A slab as received. data of `images` points to memory that `owner` keeps alive.
  struct Slab {
    wire::SliceImages images;
    std::shared_ptr<const void> owner;
  };
  /// A frame for a viewer. frame.data points into `bytes`; the service fills in packer and moments.published_s.
  struct Outgoing {
    std::string peer;  ///< address on the socket on which the viewer acknowledges
    wire::SliceFrame frame;
    std::shared_ptr<const std::vector<uint8_t>> bytes;
  };
  struct Added {
    bool is_new = false;          ///< false: it is a duplicate
    bool frame_complete = false;  ///< it was the last missing one
    uint64_t blocks = 0;          ///< coded blocks in it
  };
  struct Statistics {
    uint64_t slabs = 0;            ///< taken
    uint64_t slabs_duplicate = 0;  ///< dropped: they had come before
    uint64_t slabs_other_epoch = 0;
    uint64_t slabs_refused = 0;  ///< dropped: contradict themselves or their frame, or not decodable
    uint64_t frames_complete = 0;
    uint64_t frames_dropped = 0;  ///< dropped before they were complete
    uint64_t frames_sent = 0;     ///< counted per viewer
    uint64_t frames_skipped = 0;  ///< replaced by a newer one before the viewer was ready for them
    uint64_t viewers_forgotten = 0;
  };

  /// Sets the frames' volume and the shown epoch. If either changes, unfinished frames are dropped, and newcomers get
  /// no earlier complete frame; a viewer that waits for such a frame still gets it.
  void set_scene(const volume::Grid& grid, EpochId epoch);
  bool ready() const { return grid_.has_value(); }
  EpochId epoch() const { return epoch_; }
  /// Frames are numbered anew (another master), or show another volume. Viewers stay known; no frame counts as under
  /// way to them any more.
  void clear_frames();

  /// Sets the user's limit to each viewer, bytes per second; 0: no limit.
  void set_most(double bytes_s);

  /// Takes a slab; the last missing one makes its frame ready for take_outgoing(). Error: lease or images are invalid,
  /// or contradict the frame's other slabs; nothing has changed then. Precondition: ready().
  Result<Added> add(Slab slab, double now_s);
  /// Notes when the frame that add() has just completed was packed, on the master's clock.
  void packed(double master_s);
  /// A viewer introduces itself (frame 0) or has shown a frame. A known one that speaks over another connection gets
  /// the frames under way once more; over the same one frame 0 is a sign of life: no frame is lost there. A newcomer
  /// gets the newest complete frame, unless it wants its own in order. The slabs of a frame that it could not decode
  /// are checked (take_refused()). Error: a number of buffers beyond its limits.
  Status acknowledged(const std::string& peer, const wire::SliceAck& ack, double now_s);
  /// Returns slabs that cannot be decoded, from frames that viewers reported as damaged; each slab once.
  std::vector<wire::TileRefused> take_refused() { return std::exchange(refused_, {}); }
  /// Sending to it failed: forgets the viewers at `peer`.
  void unreachable(const std::string& peer);
  /// Forgets viewers that do not answer.
  void expire(double now_s);
  /// Returns the next frame to send; it counts as sent. In order for each viewer, never more unacknowledged than it has
  /// buffers; an asynchronous viewer gets none that would queue on its link (SlicePace), but a newer one later.
  std::optional<Outgoing> take_outgoing(double now_s);

  /// Returns when a frame that waits for a link may go out; nullopt: no frame waits for a link.
  std::optional<double> due_s() const;

  const Statistics& statistics() const { return statistics_; }
  size_t open_frames() const { return open_.size(); }
  size_t viewers() const { return viewers_.size(); }

 private:
  /// The slabs of a frame that have come.
  struct Frame {
    wire::SliceLease lease;                                 // the first slab's
    std::vector<Slab> slabs;                                // by number; without an owner: not come
    std::vector<std::vector<volume::EncodedSlice>> slices;  // one list per slab
    size_t missing = 0;
    size_t bytes = 0;
    wire::Moments moments;  // those of the slab that completed it
    uint64_t voxels = 0;
    bool looked_at = false;  // its slabs were checked to be decodable
  };
  using Frames = std::deque<std::shared_ptr<Frame>>;
  struct Waiting {
    std::shared_ptr<Frame> frame;
    wire::SliceView view;
    bool whole = false;  // the camera is another viewer's: no image is left out
    double sent_s = 0;   // 0: not sent
    size_t bytes = 0;    // sent bytes
  };
  struct Viewer {
    std::string peer;  // empty: it has frames, but has not introduced itself yet
    uint64_t buffers = 1;
    bool in_order = false;
    std::deque<Waiting> unacknowledged, waiting;  // both in order of frames
    FrameId newest;                               // the newest frame that ever waited: older ones come too late
    double heard_s = 0;                           // last acknowledgement, or first frame sent since
    bool sent_again = false;                      // a frame seemed lost since the last acknowledgement
    SlicePace pace;
  };

  Status check(const wire::SliceLease& lease) const;
  Status check_beside_others(const wire::SliceLease& lease);
  Frames::iterator find_open(FrameId id);
  bool is_here(const wire::SliceLease& lease);
  /// Returns the frame's entry among the open ones, made for its first slab. bytes: the slab's.
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
  double most_bytes_s_ = 0;  // the user's limit
  Frames open_;              // oldest first
  std::deque<FrameId> closed_;
  std::shared_ptr<Frame> completed_;  // the frame completed last
  std::shared_ptr<Frame> newest_;     // the newest complete frame
  std::map<InstanceId, Viewer> viewers_;
  InstanceId turn_;  // the viewer served last
  TokenBucket looks_{4, 4};
  std::vector<wire::TileRefused> refused_;
  Statistics statistics_;
};

}  // namespace telesplat::packer
