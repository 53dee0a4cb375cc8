#include "client/viewer/slices/source.h"

#include "common/core/clock.h"

namespace telesplat::viewer {

DrawnFrame SliceSource::draw(const FrameInput& input, image::View& view) {
  const BufferedFrame shown = cache_.displayed();
  DrawnFrame out;
  out.empty = shown.frame == nullptr;
  out.chosen_s = monotonic_s();
  if (out.empty && !input.even_empty) return out;
  const geometry::Camera& camera = input.camera;
  const auto stats = renderer_->render(
      shown.frame.get(), camera, input.look.background,
      {camera.width, camera.height, view.colour.data(), input.with_depth ? view.depth_m.data() : nullptr});
  out.resolve_cpu_ms = stats.warp_cpu_ms;
  out.drawn = stats.samples;
  out.items = stats.images;
  out.selected = out.cached = shown.pixels;
  if (out.empty) return out;
  out.sequence = shown.frame->frame.value;
  out.epoch = shown.frame->epoch;
  out.update = shown.update;
  return out;
}

std::optional<Pick> SliceSource::pick(const geometry::Camera& camera, double x_pix, double y_pix, double opacity) {
  const BufferedFrame shown = cache_.displayed();
  if (!shown.frame) return std::nullopt;
  return pick_volume(*shown.frame, camera, x_pix, y_pix, opacity);
}

}  // namespace telesplat::viewer
