#include "client/viewer/display/window_surface.h"

#include <cmath>
#include <mutex>

namespace telesplat::viewer {
namespace {

// Screenshots tell from a thread of theirs.
std::function<void(const std::string&)> one_at_a_time(std::function<void(const std::string&)> tell) {
  return [tell = std::move(tell), mutex = std::make_shared<std::mutex>()](const std::string& text) {
    const std::lock_guard lock(*mutex);
    tell(text);
  };
}

}  // namespace

geometry::Camera window_camera(const geometry::Pose& pose, double fov_deg, int width, int height, double near_m) {
  geometry::Camera camera = geometry::make_camera(pose, fov_deg, width, height, near_m);
  if (height <= width) return camera;
  const double narrow = double(width) / double(height);
  camera.left *= narrow, camera.right *= narrow, camera.bottom *= narrow, camera.top *= narrow;
  return camera;
}

Result<std::unique_ptr<WindowSurface>> WindowSurface::open(const Options& o,
                                                           std::function<void(const std::string&)> tell) {
  auto window = Window::open({o.display.width, o.display.height, o.fullscreen, "Telesplat"});
  if (!window) return window.error();
  return std::unique_ptr<WindowSurface>(new WindowSurface(o, std::move(*window), one_at_a_time(std::move(tell))));
}

WindowSurface::WindowSurface(const Options& o, std::unique_ptr<Window> window,
                             std::function<void(const std::string&)> tell)
    : options_(o.display),
      window_(std::move(window)),
      interaction_(o.recorded, {o.display.render, o.display.shading.lit}),
      tell_(tell),
      screenshots_(o.screenshot_directory, tell) {}

geometry::Camera WindowSurface::begin_frame(double now_s, double t_s, Look& look) {
  window_->poll(interaction_);
  const auto& o = options_;
  const bool playback = t_s >= 0 && (o.duration_s <= 0 || t_s < o.duration_s - o.hold_s);
  const geometry::Camera camera =
      tile_of(window_camera(interaction_.advance(now_s, playback), o.fov_deg, window_->width() * o.wall.columns,
                            window_->height() * o.wall.rows, o.near_m),
              o.wall);
  interaction_.set_height_tangent(camera.top - camera.bottom);
  look = interaction_.look();
  for (const auto& note : interaction_.take_notes()) tell_(note);
  return camera;
}

void WindowSurface::present(const image::View& view) {
  window_->present(view, overlays_);
  if (interaction_.take_screenshot_wish()) screenshots_.take(view);
}

void WindowSurface::report(const LiveFigures& figures) {
  if (figures.extent_m > 0) interaction_.set_extent(figures.extent_m);
  if (const auto title = title_.update(figures)) window_->set_title(*title);
}

}  // namespace telesplat::viewer
