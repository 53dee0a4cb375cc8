#include "client/displays/window/window_views.h"

#include <cmath>
#include <utility>

#include "common/geometry/fit.h"

namespace telesplat::viewer {
namespace {

constexpr double kSteps = 32;         // the legend's share of the window's width counts in such steps
constexpr double kMostCovered = 0.6;  // share of the window's width that may be covered; else the first view uses all

}  // namespace

geometry::Camera window_camera(const geometry::Pose& pose, double fov_deg, int width, int height, double near_m) {
  geometry::Camera camera = geometry::make_camera(pose, fov_deg, width, height, near_m);
  if (height <= width) return camera;
  const double narrow = double(width) / double(height);
  camera.left *= narrow, camera.right *= narrow, camera.bottom *= narrow, camera.top *= narrow;
  return camera;
}

// Returns the camera of all tiles of a wall.
geometry::Camera WindowViews::whole(const geometry::Pose& pose) const {
  const auto& o = options_.display;
  if (o.wall.described) return wall::fitting_frustum(*o.wall.described, o.near_m);
  const stereo::Size eye = o.stereo.eye_size(window_.width(), window_.height());
  return window_camera(pose, o.fov_deg, eye.width * o.wall.columns, eye.height * o.wall.rows, o.near_m);
}

// Returns the part that panel and legend leave free. Walls and two eyes use the whole window.
WindowViews::FreePart WindowViews::free_part() const {
  const auto& o = options_.display;
  FreePart out{whole({}), 0};
  if (o.wall.described || o.wall.tiles() > 1 || o.stereo.on()) return out;
  const double left = double(window_.hidden()) / window_.width();
  // A legend that was dragged to the left is ignored. Its width counts in steps, since it changes with its numbers.
  const bool at_right = legend_.built() && legend_.part().left > 0.5;
  const double right = at_right ? std::ceil((1 - legend_.part().left) * kSteps) / kSteps : 0;
  if (!(left + right <= kMostCovered)) return out;
  geometry::Camera& c = out.frustum;
  out.middle_x = (left - right) * (c.right - c.left) / 2;
  for (double* side : {&c.left, &c.right}) *side *= 1 - left - right;
  return out;
}

void WindowViews::fit() {
  if (!has_scene()) return;
  const FreePart part = free_part();
  const auto& f = part.frustum;
  const std::array<double, 4> now{f.right, f.top, part.middle_x, double(window_.width())};
  if (now == fitted_) return;
  fitted_ = now;
  const auto& movement = options_.head.movement;
  const double middle_x = movement.eye ? 0 : part.middle_x;
  interaction_.set_scene(scene_.pipeline, scene_.box_room, movement.first_view(scene_.box_room, f, middle_x), middle_x);
  if (movement.orbits) interaction_.set_recorded(movement.trajectory(scene_.box_room, whole({})));
}

void WindowViews::look_from(const Side& side, const SceneTerms* terms) {
  if (!has_scene()) return;
  glm::dvec3 back(0.0);
  back[side.axis] = side.negative ? -1 : 1;
  if (terms) back = glm::normalize(glm::dmat3(terms->placement.data_to_room) * back);
  const FreePart part = free_part();
  interaction_.travel(geometry::fitted_view_from(back, scene_.box_room, part.frustum, part.middle_x),
                      "view from " + side_name(side));
}

geometry::Camera WindowViews::camera_of(const geometry::Pose& head) const {
  const auto& o = options_.display;
  if (!o.wall.described) return tile_of(whole(head), o.wall);
  geometry::Camera camera = wall::screen_camera(*o.wall.described, o.wall.tile, head, o.near_m);
  const stereo::Size eye = o.stereo.eye_size(window_.width(), window_.height());
  camera.width = eye.width, camera.height = eye.height;
  return camera;
}

bool WindowViews::on_session(const scene::SessionView& facts) {
  if (facts.fact("scene").empty()) return false;
  const std::string name =
      facts.fact("scene") + '\n' + facts.fact("data_file") + '\n' + facts.fact(scene::kPlacementFact);
  const std::string before = std::exchange(scene_name_, name);
  if (before.empty() || before == name) return false;
  interaction_.back_to_first_view();
  return true;
}

}  // namespace telesplat::viewer
