// Receives a session's frames of slice images: keeps the newest one, or those that wait for the display, in order.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "client/viewer/display/view_source.h"
#include "client/viewer/received.h"
#include "client/viewer/render/renderer.h"
#include "client/viewer/slices/cache.h"
#include "common/core/log.h"

namespace telesplat::viewer {

class SliceRecorder;

class ReceivedSlices final : public Received {
 public:
  /// Frames under way to an asynchronous viewer: while one is decoded the next one travels.
  static constexpr uint64_t kAsyncBuffers = 2;

  ReceivedSlices(const ReceivedOptions& options, const ReceivedLinks& links);

  /// Without a valid grid it takes no frames.
  Status follow(const wire::Welcome& session) override;
  std::span<const Feed> feeds() const override;
  void on_connected() override { heard_s_ = introduced_s_ = -1e9, newest_ = acknowledged_ = {}; }
  void on_new_master() override { on_connected(); }
  void receive(int most) override;
  /// Acknowledges frames that have left their buffers. Introduces this viewer every second until a frame has come, and
  /// when no frame came for long: a packer that was restarted at the same address does not know this viewer.
  void tick(double now_s) override;
  void on_coupling(int buffers) override;
  wire::ShownState newest_state() const override;
  void show_state(const wire::ShownState& state) override;
  bool shows_whole_frames() const override { return true; }
  void add_status(net::MasterLink::Values& values) const override;
  Result<std::unique_ptr<ViewSource>> make_source(const DisplayOptions& options, Renderers& renderers) override;

 private:
  void on(const wire::SliceFrame& frame, double arrived_s, net::Socket& state);
  void acknowledge(FrameId frame, net::Socket& state, bool damaged = false);
  void acknowledge_left(net::Socket& state);

  ReceivedLinks links_;
  uint64_t buffers_;             // buffers of the coupling; 0: asynchronous
  SliceRecorder* const record_;  // keeps every frame that goes into the cache; null: there is no record
  SliceCache cache_;
  std::optional<volume::Grid> grid_;
  std::vector<volume::SliceImage> images_;
  InstanceId packer_, master_;
  FrameId newest_, acknowledged_;
  RequestId newest_request_;   // newest request that a frame has answered
  bool tell_buffers_ = false;  // the packer must get the new number of buffers
  EpochId epoch_;
  double introduced_s_ = -1e9, heard_s_ = -1e9;  // -1e9: nothing came or went yet
  uint64_t decode_errors_ = 0;
  log::RateLimiter log_limit_;
};

/// The display's source for slice images: warps the newest complete frame into the present view, or the next one if the
/// display waits.
class SliceSource final : public ViewSource {
 public:
  SliceSource(std::unique_ptr<VolumeRenderer> renderer, SliceCache& cache)
      : renderer_(std::move(renderer)), cache_(cache) {}

  void advance(RequestId request) override { cache_.advance(request); }
  std::optional<Pick> pick(const geometry::Camera& camera, double x_pix, double y_pix, double opacity) override;
  DrawnFrame draw(const FrameInput& input, image::View& view) override;
  DrawnFrame draw_pair(const FrameInput& input, const std::array<geometry::Camera, 2>& eyes,
                       const std::array<splat::FrameTarget, 2>& targets) override;
  void displayed() override { cache_.frame_done(); }
  DrawnUnits units() const override { return {"samples", " pixels"}; }

 private:
  DrawnFrame draw_views(const FrameInput& input, std::span<const geometry::Camera> cameras,
                        std::span<const volume::WarpTarget> targets);

  std::unique_ptr<VolumeRenderer> renderer_;
  SliceCache& cache_;
};

}  // namespace telesplat::viewer
