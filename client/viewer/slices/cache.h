// The viewer's complete volume frames, shared by the worker that decodes them and the display thread that warps them.
// Frames change hands as pointers; nothing is copied, and none is freed by the display thread.
#pragma once

#include <deque>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "client/viewer/coupling/coupling.h"
#include "common/volume/slices/image.h"
#include "common/volume/warp/warper.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// A complete frame and what it answers.
struct BufferedFrame {
  std::shared_ptr<const volume::VolumeFrame> frame;
  ShownUpdate update;
  uint64_t pixels = 0;  ///< that it holds
  InstanceId source;    ///< the master that numbered it
};

/// Pixels of all images of a frame, those of its layers included, at most (1 GiB): a few bytes can claim many of them.
inline constexpr uint64_t kMaxSlicePixels = 1u << 28;
/// Checks and decodes. Bytes come from outside. Error: what is wrong with it, for the log. images: memory that is used
/// again.
Result<BufferedFrame> decode_frame(const wire::SliceFrame& frame, const volume::Grid& grid,
                                   std::vector<volume::SliceImage>& images);

class SliceCache {
 public:
  /// in_order false (asynchronous): the newest frame is the one on display. true: frames wait in order until the
  /// display advances to them; whoever puts them in takes care that they are not too many.
  /// in_step: asynchronously too frames wait, until show_until() says that other viewers show them as well; of more
  /// than kMostInStep the oldest goes on display.
  explicit SliceCache(bool in_order, bool in_step = false) : in_order_(in_order), in_step_(in_step) {}
  static constexpr size_t kMostInStep = 8;

  // ---- worker ----
  void put(BufferedFrame frame);
  /// Frees frames that are not on display any more and that no draw holds. To be called often.
  void free_dropped();
  /// In order: frames that have been displayed, or passed over, since the last call: they have left their buffers.
  std::vector<FrameId> take_left();
  /// As in the constructor, from now on. Where frames waited in order the newest of them goes on display.
  void set_in_order(bool in_order);

  // ---- display thread ----
  /// The frame on display; frame.frame is null before the first.
  BufferedFrame displayed() const;
  /// In order: the frame of this request goes on display, those before it that still wait are passed over. No effect if
  /// none waits for it.
  void advance(RequestId request);
  /// In step, asynchronously: the newest that waits up to this one goes on display. Frames of other masters than
  /// `source` go before its own.
  void show_until(InstanceId source, FrameId frame);
  struct Newest {
    InstanceId source;  ///< who numbered it
    FrameId frame;      ///< 0: there is none
    uint64_t held = 0;  ///< bit n: the frame so many before it is here too, on display or waiting
  };
  /// The newest frame that is here.
  Newest newest() const;
  /// The frame on display has been displayed.
  void frame_done();

  // ---- any thread ----
  struct Figures {
    uint64_t frames = 0;             ///< put in so far
    uint64_t buffered = 0;           ///< waiting to be displayed
    uint64_t pixels = 0, bytes = 0;  ///< held, the one on display included; memory of their pixels
  };
  Figures figures() const;

 private:
  void show(BufferedFrame frame);

  mutable std::mutex mutex_;
  bool in_order_;
  const bool in_step_;
  InstanceId newest_source_;
  FrameId newest_;
  BufferedFrame displayed_;
  std::deque<BufferedFrame> waiting_;
  std::vector<std::shared_ptr<const volume::VolumeFrame>> dropped_;
  std::vector<FrameId> left_;
  bool counted_ = true;  // the one on display is in left_ already
  uint64_t frames_ = 0;
};

}  // namespace telesplat::viewer
