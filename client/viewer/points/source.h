// The display's source for scenes of points: selects from the model cache, splats.
#pragma once

#include "client/viewer/display/display_options.h"
#include "client/viewer/display/view_source.h"
#include "client/viewer/points/received_points.h"
#include "client/viewer/render/renderer.h"
#include "common/splat/select/frame_budget.h"

namespace telesplat::viewer {

class PointSource final : public ViewSource {
 public:
  PointSource(const DisplayOptions& options, std::unique_ptr<Renderer> renderer, ReceivedPoints& received);

  void advance(RequestId request) override { received_.advance(request); }
  DrawnFrame draw(const FrameInput& input, image::View& view) override;
  const char* drawn_name() const override { return "points"; }
  const char* cached_name() const override { return ""; }

 private:
  void find_coverage(const FrameInput& input, image::View& view);

  DisplayOptions options_;
  std::unique_ptr<Renderer> renderer_;
  ReceivedPoints& received_;
  image::View over_white_;
  splat::FrameBudget budget_;
  splat::SpeedDetail speed_;
  splat::DrawList list_;
};

}  // namespace telesplat::viewer
