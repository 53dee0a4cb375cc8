// The display's source for slice images: warps the newest complete frame of slice images, or where the display waits
// the next one, into the view of now.
#pragma once

#include <span>

#include "client/viewer/display/view_source.h"
#include "client/viewer/render/slices/renderer.h"
#include "client/viewer/slices/cache.h"

namespace telesplat::viewer {

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
  const char* drawn_name() const override { return "samples"; }
  const char* cached_name() const override { return " pixels"; }

 private:
  DrawnFrame draw_views(const FrameInput& input, std::span<const geometry::Camera> cameras,
                        std::span<const volume::WarpTarget> targets);

  std::unique_ptr<VolumeRenderer> renderer_;
  SliceCache& cache_;
};

}  // namespace telesplat::viewer
