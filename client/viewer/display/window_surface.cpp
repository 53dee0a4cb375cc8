#include "client/viewer/display/window_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <mutex>

#include "common/core/clock.h"

namespace telesplat::viewer {
namespace {

constexpr double kShowAgain_s = 0.1;

// Screenshots tell from a thread of theirs.
std::function<void(const std::string&)> one_at_a_time(std::function<void(const std::string&)> tell) {
  return [tell = std::move(tell), mutex = std::make_shared<std::mutex>()](const std::string& text) {
    const std::lock_guard lock(*mutex);
    tell(text);
  };
}

// What plays from the beginning. An orbit is fitted once it is known around what.
std::optional<geometry::Trajectory> first_movement(const HeadMovement& movement) {
  if (movement.recorded) return *movement.recorded;
  return movement.orbits ? std::optional(geometry::Trajectory::orbit()) : std::nullopt;
}

// As large as the keys fit into the window.
int help_scale(int width, int height) {
  const image::View smallest = text_panel(key_help(), 1);
  return std::clamp(std::min(width / (smallest.width + 12), height / (2 * smallest.height)), 1, 4);
}

// A name that no file has.
std::string dated_path(const std::string& before, const std::string& after) {
  char date[32];
  const std::time_t now = std::time(nullptr);
  std::strftime(date, sizeof date, "%Y%m%d-%H%M%S", std::localtime(&now));
  std::string out = before + date + after;
  std::error_code error;
  for (int n = 2; std::filesystem::exists(out, error); ++n) out = fmt::format("{}{}-{}{}", before, date, n, after);
  return out;
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
    : options_(o),
      window_(std::move(window)),
      interaction_(first_movement(o.movement), {o.display.render, o.display.shading.lit}),
      tell_(tell),
      screenshots_(o.screenshot_directory, tell) {
  tell_(first_keys());
}

WindowSurface::~WindowSurface() {
  interaction_.end_path();
  keep_path();
}

// Of all tiles of a wall.
geometry::Camera WindowSurface::whole(const geometry::Pose& pose) const {
  const auto& o = options_.display;
  return window_camera(pose, o.fov_deg, window_->width() * o.wall.columns, window_->height() * o.wall.rows, o.near_m);
}

void WindowSurface::on_scene(const ShownScene& scene) {
  scene_ = scene;
  fitted_width_ = 0;
}

// The first view suits the window as it is; the camera follows it until the person takes it.
void WindowSurface::fit_views() {
  if (scene_.box_room.empty() || (fitted_width_ == window_->width() && fitted_height_ == window_->height())) return;
  fitted_width_ = window_->width();
  fitted_height_ = window_->height();
  const auto& movement = options_.movement;
  interaction_.set_scene(scene_.pipeline, scene_.box_room, movement.first_view(scene_.box_room, whole({})));
  if (movement.orbits) interaction_.set_recorded(movement.trajectory(scene_.box_room, whole({})));
}

geometry::Camera WindowSurface::begin_frame(double now_s, double t_s, Look& look) {
  window_->poll(interaction_);
  fit_views();
  const auto& o = options_.display;
  const bool playback = t_s >= 0 && (o.duration_s <= 0 || t_s < o.duration_s - o.hold_s);
  const geometry::Camera camera = tile_of(whole(interaction_.advance(now_s, playback)), o.wall);
  interaction_.set_height_tangent(camera.top - camera.bottom);
  look = interaction_.look();
  show_help();
  keep_path();
  return camera;
}

void WindowSurface::show_help() {
  const int scale = interaction_.shows_help() ? help_scale(window_->width(), window_->height()) : 0;
  if (scale == help_scale_) return;
  help_scale_ = scale;
  if (scale > 0)
    overlays_.show("help", {text_panel(key_help(), scale), Overlay::Corner::kUpperLeft});
  else
    overlays_.hide("help");
}

// What keys led to: lines for the person, and a path that is complete.
void WindowSurface::keep_path() {
  for (const auto& note : interaction_.take_notes()) tell_(note);
  const auto path = interaction_.take_path();
  if (path.empty()) return;
  const std::string name = dated_path(options_.path_directory + "/path-", ".csv");
  std::error_code error;
  std::filesystem::create_directories(options_.path_directory, error);
  const Status written = geometry::write_trajectory(name, path);
  tell_(written ? fmt::format("the camera's path of {:.1f} s: {} (T plays it, --trajectory takes it)", path.back().t_s,
                              name)
                : written.error().text);
}

// A window system may want it again at any time, without telling.
void WindowSurface::present(const image::View& view, bool changed) {
  const Shown now{monotonic_s(), window_->width(), window_->height(), overlays_.version()};
  const bool same = now.width == shown_.width && now.height == shown_.height && now.overlays == shown_.overlays;
  if (!changed && same && now.at_s - shown_.at_s < kShowAgain_s) return;
  shown_ = now;
  window_->present(view, overlays_);
}

void WindowSurface::on_legend(const std::shared_ptr<const image::Legend>& legend) {
  if (legend_ == legend && legend_width_ == window_->width() && legend_height_ == window_->height()) return;
  legend_ = legend;
  legend_width_ = window_->width();
  legend_height_ = window_->height();
  show_legend();
}

// On a wall the tile in the lower right corner has it.
void WindowSurface::show_legend() {
  const WallTile& wall = options_.display.wall;
  if (!legend_ || wall.tile != wall.columns * wall.rows - 1) return overlays_.hide("legend");
  overlays_.show("legend",
                 {image::legend_picture(*legend_, legend_width_, legend_height_), Overlay::Corner::kLowerRight});
}

void WindowSurface::take_picture(const image::View& view, image::Alpha alpha) {
  if (!interaction_.take_screenshot_wish()) return;
  if (!legend_) return screenshots_.take(view, alpha);
  image::View copy{view.width, view.height, view.colour, {}};
  image::draw_legend(copy, *legend_, part_of_wall(view.width, view.height, options_.display.wall));
  screenshots_.take(copy, alpha);
}

void WindowSurface::report(const LiveFigures& figures) {
  if (const auto title = title_.update(figures)) title_text_ = *title;
  const std::string title = interaction_.records_path() ? fmt::format("{} - recording the camera's path, {:.0f} s",
                                                                      title_text_, interaction_.path_s())
                                                        : title_text_;
  if (title != title_shown_) window_->set_title(title_shown_ = title);
}

}  // namespace telesplat::viewer
