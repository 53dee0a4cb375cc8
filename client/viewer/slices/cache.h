// The viewer's complete volume frames, shared by the worker that decodes them and the display thread that warps them.
// Only pointers change hands; nothing is copied, and the display thread frees no frame.
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

/// A complete frame, and the update that it answers.
struct BufferedFrame {
  std::shared_ptr<const volume::VolumeFrame> frame;
  ShownUpdate update;
  uint64_t pixels = 0;  ///< pixels of the frame
  InstanceId source;    ///< the master that numbered it
};

/// Pixels of all images of a frame and of its layers, at most (1 GiB): a few bytes can claim many.
inline constexpr uint64_t kMaxSlicePixels = 1u << 28;
/// Checks and decodes bytes that come from outside. Error: what is wrong with the frame, for the log. images: memory
/// that is reused.
Result<BufferedFrame> decode_frame(const wire::SliceFrame& frame, const volume::Grid& grid,
                                   std::vector<volume::SliceImage>& images);

class SliceCache {
 public:
  /// in_order false (asynchronous): the newest frame is on display. true: frames wait in order until the display
  /// advances to them; the caller of put() limits their number. in_step: frames wait in asynchronous mode, too, until
  /// show_until() says that other viewers show them as well; beyond kMostInStep the oldest goes on display.
  explicit SliceCache(bool in_order, bool in_step = false) : in_order_(in_order), in_step_(in_step) {}
  static constexpr size_t kMostInStep = 8;

  // ---- worker ----
  void put(BufferedFrame frame);
  /// Frees frames that are neither on display nor held by a draw. To be called often.
  void free_dropped();
  /// In order: returns frames that were displayed or skipped since the last call: they have left their buffers.
  std::vector<FrameId> take_left();
  /// Changes in_order. If frames waited in order, the newest of them goes on display.
  void set_in_order(bool in_order);

  // ---- display thread ----
  /// The frame on display; frame.frame is null before the first.
  BufferedFrame displayed() const;
  /// In order: puts the frame of this request on display, and skips those before it that still wait. Does nothing if no
  /// such frame waits.
  void advance(RequestId request);
  /// In step, asynchronously: puts the newest waiting frame up to this one on display. Frames of other masters than
  /// `source` go before its own.
  void show_until(InstanceId source, FrameId frame);
  struct Newest {
    InstanceId source;  ///< the master that numbered `frame`
    FrameId frame;      ///< 0: there is no frame
    uint64_t held = 0;  ///< bit n: the frame n before it is here too, on display or waiting
  };
  /// The newest frame that is here.
  Newest newest() const;
  /// The frame on display has been displayed.
  void frame_done();

  // ---- any thread ----
  struct Figures {
    uint64_t frames = 0;             ///< put in so far
    uint64_t buffered = 0;           ///< waiting to be displayed
    uint64_t pixels = 0, bytes = 0;  ///< held, with the one on display; memory of their pixels
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
  bool counted_ = true;  // the frame on display is in left_ already
  uint64_t frames_ = 0;
};

}  // namespace telesplat::viewer
