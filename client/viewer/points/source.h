// The display's source for scenes of points: selects from the model cache, and splats.
#pragma once

#include "client/viewer/display/display_options.h"
#include "client/viewer/display/view_source.h"
#include "client/viewer/points/frame_detail.h"
#include "client/viewer/points/received_points.h"
#include "client/viewer/points/still_picture.h"
#include "client/viewer/render/supersampler.h"

namespace telesplat::viewer {

/// While the camera and the look stay the same, the picture is refined with sub-pixels, tile by tile, within a share of
/// each frame's time. Parts that are in the view already are not drawn again.
class PointSource final : public ViewSource {
 public:
  PointSource(const DisplayOptions& options, std::unique_ptr<Renderer> renderer, ReceivedPoints& received);

  void advance(RequestId request) override { received_.advance(request); }
  std::optional<Pick> pick(const geometry::Camera& camera, double x_pix, double y_pix, double opacity) override;
  DrawnFrame draw(const FrameInput& input, image::View& view) override;
  /// Draws both eyes. It does not refine still pictures with sub-pixels.
  DrawnFrame draw_pair(const FrameInput& input, const std::array<geometry::Camera, 2>& eyes,
                       const std::array<splat::FrameTarget, 2>& targets) override;
  bool draws_into_parts() const override { return true; }

 private:
  DrawnFrame begin_frame(const FrameInput& input);
  void end_frame(DrawnFrame& out);
  bool stands_still(const FrameInput& input);
  void select(const FrameInput& input, double detail, DrawnFrame& out);
  void draw_list(const FrameInput& input, const image::Shading& shading, image::View& view, DrawnFrame& out);
  void draw_moving(const FrameInput& input, image::View& view, DrawnFrame& out);
  void draw_still(const FrameInput& input, image::View& view, DrawnFrame& out);
  void refine(const FrameInput& input, image::View& view, DrawnFrame& out);
  void find_coverage(const FrameInput& input, const geometry::Camera& camera, image::View& view);
  void find_coverage(const FrameInput& input, const geometry::Camera& camera, const splat::FrameTarget& target);
  void add_figures(DrawnFrame& out) const;

  DisplayOptions options_;
  std::unique_ptr<Renderer> renderer_;
  ReceivedPoints& received_;
  image::View over_white_;
  FrameDetail detail_;
  splat::DrawList list_;
  uint64_t drawn_ = 0;  // points of list_ that were drawn
  ReceivedPoints::Cut cut_;

  StillHead head_;

  // Drawn since the camera came to rest.
  ModelCache::Changes changes_;
  std::vector<geometry::Rect> ray_changes_;  // rectangles of the picture
  StillPicture still_;
  Supersampler supersampler_;
  TileTime tile_time_;
  std::optional<image::Shading> still_shading_;  // nothing: no still picture has begun
  uint64_t base_ = 0;                            // splat::names_of() for the picture without sub-pixels
  bool base_stale_ = true;  // the picture without sub-pixels, where the view shows it, is older than the model
  double seen_s_ = 0;
  bool pair_sharp_ = false;  // the pair on display was drawn at full detail
};

}  // namespace telesplat::viewer
