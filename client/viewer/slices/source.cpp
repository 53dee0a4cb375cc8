#include "client/viewer/slices/source.h"

#include "common/core/clock.h"

namespace telesplat::viewer {

DrawnFrame SliceSource::draw_views(const FrameInput& input, std::span<const geometry::Camera> cameras,
                                   std::span<const volume::WarpTarget> targets) {
  const BufferedFrame shown = cache_.displayed();
  DrawnFrame out;
  out.empty = shown.frame == nullptr;
  out.chosen_s = monotonic_s();
  if (out.empty && !input.even_empty) return out;
  for (size_t i = 0; i < cameras.size(); ++i) {
    const auto stats = renderer_->render(shown.frame.get(), cameras[i], input.look.background, targets[i]);
    out.resolve_cpu_ms += stats.warp_cpu_ms;
    out.drawn += stats.samples;
    out.items += stats.images;
  }
  out.selected = out.cached = shown.pixels;
  if (out.empty) return out;
  out.sequence = shown.frame->frame.value;
  out.epoch = shown.frame->epoch;
  out.update = shown.update;
  return out;
}

DrawnFrame SliceSource::draw(const FrameInput& input, image::View& view) {
  const volume::WarpTarget target{view.width, view.height, view.colour.data(),
                                  input.with_depth ? view.depth_m.data() : nullptr};
  return draw_views(input, {&input.camera, 1}, {&target, 1});
}

DrawnFrame SliceSource::draw_pair(const FrameInput& input, const std::array<geometry::Camera, 2>& eyes,
                                  const std::array<splat::FrameTarget, 2>& targets) {
  std::array<volume::WarpTarget, 2> both;
  for (size_t i = 0; i < 2; ++i) both[i] = {targets[i].width, targets[i].height, targets[i].colour, targets[i].depth_m};
  return draw_views(input, eyes, both);
}

std::optional<Pick> SliceSource::pick(const geometry::Camera& camera, double x_pix, double y_pix, double opacity) {
  const BufferedFrame shown = cache_.displayed();
  if (!shown.frame) return std::nullopt;
  return pick_volume(*shown.frame, camera, x_pix, y_pix, opacity);
}

}  // namespace telesplat::viewer
