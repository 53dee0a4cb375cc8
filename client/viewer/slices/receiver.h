// The worker's part for volumes: takes complete frames of slice images, checks and decodes them, puts them into the
// cache, acknowledges them.
#pragma once

#include <functional>
#include <optional>

#include "client/viewer/coupling/view_requester.h"
#include "client/viewer/slices/cache.h"
#include "common/core/log.h"
#include "common/metrics/recorder.h"
#include "common/net/socket.h"

namespace telesplat::viewer {

class SliceRecorder;

class SliceReceiver {
 public:
  /// Pixels of all images of a frame, those of its layers included, at most (1 GiB): a few bytes can claim many of
  /// them.
  static constexpr uint64_t kMaxPixels = 1u << 28;
  /// Frames on their way to an asynchronous viewer: while one is decoded the next one travels.
  static constexpr uint64_t kAsyncBuffers = 2;

  struct Options {
    InstanceId viewer;
    uint64_t buffers = 0;             ///< of the coupling; 0: asynchronous
    SliceRecorder* record = nullptr;  ///< keeps every frame that goes into the cache; null: nothing is kept
  };
  struct Links {
    std::function<std::optional<double>(RequestId)> requested_s;  ///< ViewRequester
    std::function<bool(RequestId)> expected;                      ///< whether it is open; asked where the display waits
    std::function<void(const ViewPart&)> on_part;                 ///< a frame is in the cache
    std::function<void(RequestId)> on_lost;                       ///< the answer to it cannot be decoded
    std::function<void()> on_epoch;  ///< its epoch is another than that of the frame before
    std::function<double(double)> to_master_s;
  };
  SliceReceiver(const Options& options, Links links, SliceCache& cache, metrics::SpanRecorder& spans);

  /// What the master knows of the volume. Without a valid grid no frame is taken.
  Status set_session(const wire::Welcome& session);
  /// Another packer, which does not know this viewer; or another master, which numbers frames anew.
  void begin_anew() { heard_s_ = introduced_s_ = -1e9, newest_ = acknowledged_ = {}; }
  /// Of the coupling, from now on; the packer is told with the next tick().
  void set_buffers(uint64_t buffers);
  void receive(net::Socket& state, int most);
  /// Acknowledges frames that have left their buffers; says "here I am" every second until a frame has come, and when
  /// none came for long: a packer that was restarted where it was does not know this viewer.
  void tick(double now_s, net::Socket& state);

  /// Checks and decodes. Bytes come from outside. Error: what is wrong with it, for the log. images: memory that is
  /// used again.
  static Result<BufferedFrame> decode(const wire::SliceFrame& frame, const volume::Grid& grid,
                                      std::vector<volume::SliceImage>& images);

  struct Figures {
    uint64_t pixels_received = 0, decode_errors = 0;
  };
  Figures figures() const { return {pixels_received_, decode_errors_}; }

 private:
  void on(const wire::SliceFrame& frame, double arrived_s, net::Socket& state);
  void acknowledge(FrameId frame, net::Socket& state, bool damaged = false);
  void acknowledge_left(net::Socket& state);

  Options options_;
  Links links_;
  SliceCache& cache_;
  metrics::SpanRecorder& spans_;
  std::optional<volume::Grid> grid_;
  std::vector<volume::SliceImage> images_;
  InstanceId packer_, master_;
  FrameId newest_, acknowledged_;
  bool tell_buffers_ = false;  // to the packer
  EpochId epoch_;
  double introduced_s_ = -1e9, heard_s_ = -1e9;  // -1e9: nothing came yet
  uint64_t pixels_received_ = 0, decode_errors_ = 0;
  log::RateLimiter log_limit_;
};

}  // namespace telesplat::viewer
