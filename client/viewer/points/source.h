// The display's source for scenes of points: selects from the model cache, splats.
#pragma once

#include "client/viewer/display/display_loop.h"
#include "client/viewer/display/view_source.h"
#include "client/viewer/render/renderer.h"
#include "common/splat/select/frame_budget.h"

namespace telesplat::viewer {

class PointSource final : public ViewSource {
 public:
  PointSource(const DisplayOptions& options, std::unique_ptr<Renderer> renderer, ViewerCaches& caches,
              ReplicaWorker& worker);

  void advance(RequestId request) override;
  DrawnFrame draw(const FrameInput& input, image::View& view) override;
  const char* drawn_name() const override { return "points"; }
  const char* cached_name() const override { return ""; }

 private:
  DisplayOptions options_;
  std::unique_ptr<Renderer> renderer_;
  ViewerCaches& caches_;
  ReplicaWorker& worker_;
  splat::FrameBudget budget_;
  splat::SpeedDetail speed_;
  splat::DrawList list_;
  ShownUpdate shown_;  // where the display waits
};

}  // namespace telesplat::viewer
