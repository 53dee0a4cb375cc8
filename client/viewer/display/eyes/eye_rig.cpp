#include "client/viewer/display/eyes/eye_rig.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "client/stereo/autostereo/panel_file.h"
#include "client/stereo/compose.h"
#include "common/core/within.h"
#include "common/geometry/stereo.h"

namespace telesplat::viewer {
namespace {

constexpr double kLeastScreen_m = 0.05;  // eyes would squint at a nearer screen
constexpr double kNearestEye_m = 0.01;   // before a wall's screen: a turned head may put one eye behind it
constexpr double kFarthestEye_m = 99;    // before a panel
// Depths of the scene that widen the sampled view: no eye looks at nearer parts, farther ones make no difference.
constexpr double kNearest_m = 0.1, kFarthest_m = 10, kStepsAnOctave = 4;

// Returns the screen before the head. A panel's height comes from its pixels, not from the shape of eyes' pictures.
geometry::Screen screen_before(const StereoOptions& o, const geometry::Camera& head, double screen_m) {
  geometry::Screen screen = geometry::screen_before(head, screen_m);
  if (o.panel) screen.height_m = screen.width_m * o.panel->height_m() / o.panel->width_m();
  return screen;
}

geometry::Camera through(const geometry::Screen& screen, const glm::dvec3& eye_room, const geometry::Camera& head) {
  return geometry::camera_through(screen, eye_room, head.width, head.height, head.near_m);
}

// Returns the depth of the box's nearest corner along the camera's line of sight.
double nearest_depth(const geometry::Camera& camera, const geometry::Box& box) {
  const glm::dvec3 forward = camera.pose.orientation * glm::dvec3(0, 0, -1);
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 corner(i & 1 ? box.hi.x : box.lo.x, i & 2 ? box.hi.y : box.lo.y, i & 4 ? box.hi.z : box.lo.z);
    nearest = std::min(nearest, glm::dot(corner - camera.pose.position_room, forward));
  }
  return nearest;
}

}  // namespace

EyeRig::EyeRig(const StereoOptions& options) : options_(options), screen_m_(options.screen_m) {
  if (options_.panel) interleaver_ = std::make_unique<stereo::Interleaver>(*options_.panel);
}

double EyeRig::screen_distance(const geometry::Camera& head, double t_s, const geometry::Box& scene_room) {
  if (options_.screen_width_m > 0) return options_.screen_width_m / (head.right - head.left);
  if (screen_m_ > 0) return screen_m_;
  const double middle_m =
      scene_room.empty() ? 1.0 : glm::distance(glm::dvec3(scene_room.centre()), head.pose.position_room);
  const double screen_m = std::max({middle_m, kLeastScreen_m, 2 * head.near_m});
  if (t_s >= 0 && !scene_room.empty()) screen_m_ = screen_m;
  return screen_m;
}

// In the room a panel is as wide as the view of the head's camera there: the room is a scaled model of it.
EyePair EyeRig::eyes(const geometry::Camera& head, const glm::dquat& turned, double t_s,
                     const geometry::Box& scene_room) {
  const double screen_m = screen_distance(head, t_s, scene_room);
  const geometry::Screen screen = screen_before(options_, head, screen_m);
  const double scale = options_.panel ? screen.width_m / options_.panel->width_m() : 1;
  const glm::dvec3 half(0.5 * options_.eye_separation_m, 0, 0);
  // The vectors below are on the screen's axes.
  glm::dvec3 middle = geometry::seen_from(screen, head.pose.position_room) / scale;
  glm::dvec3 to_right = glm::conjugate(screen.pose.orientation) * (turned * half);
  if (options_.panel && options_.tracked_head) {
    const geometry::Pose tracked = options_.tracked_head->at(std::max(0.0, t_s));
    middle = tracked.position_room;
    to_right = tracked.orientation * half;
  }
  const auto in_room = [&](glm::dvec3 on_axes) {
    const double nearest_m = options_.panel ? stereo::nearest_eye_m(*options_.panel) : kNearestEye_m / scale;
    on_axes.z = within(on_axes.z, nearest_m, std::max(kFarthestEye_m, nearest_m));
    return screen.pose.position_room + screen.pose.orientation * (on_axes * scale);
  };
  return recorded_eyes(options_, head, screen_m, {in_room(middle - to_right), in_room(middle + to_right)});
}

geometry::Camera EyeRig::sampled(const EyePair& pair, const geometry::Box& scene_room) {
  const double depth_m = scene_room.empty() ? pair.screen_m : nearest_depth(pair.head, scene_room);
  // The depth changes in steps, so that a head that nearly rests asks for one and the same view.
  const double steps = std::floor(kStepsAnOctave * std::log2(within(depth_m, kNearest_m, kFarthest_m)));
  return geometry::widened_for(pair.head, pair.eyes, std::exp2(steps / kStepsAnOctave));
}

void EyeRig::compose(const EyePair& pair, const std::array<image::View, 2>& views, bool with_depth, image::View& out) {
  const size_t left = options_.swap_eyes ? 1 : 0;
  if (interleaver_)
    interleaver_->compose(stereo::eyes_of(interleaver_->panel(), pair.eyes), views[left], views[1 - left], out);
  else
    stereo::compose(options_.mode, views[left], views[1 - left], out, with_depth);
}

stereo::Size EyeRig::composed_size(int width, int height) const {
  if (options_.panel) return {options_.panel->width, options_.panel->height};
  return stereo::composed_size(options_.mode, {width, height});
}

bool EyeRig::draw_pattern(std::array<image::View, 2>& views) const {
  if (options_.pattern == stereo::Pattern::kNone) return false;
  auto patterns = stereo::eye_patterns(options_.pattern, views[0].width, views[0].height);
  for (size_t eye = 0; eye < 2; ++eye) views[eye].colour = std::move(patterns[eye].colour);
  return true;
}

Status EyeRig::read_panel_again() {
  auto panel = stereo::read_panel(options_.panel_file);
  if (!panel) return panel.error();
  panel->width = options_.panel->width, panel->height = options_.panel->height;
  panel->eye = options_.panel->eye;
  options_.panel = *panel;
  interleaver_ = std::make_unique<stereo::Interleaver>(*panel);
  return ok_status();
}

EyePair recorded_eyes(const StereoOptions& options, const geometry::Camera& head, double screen_m,
                      const std::array<glm::dvec3, 2>& places) {
  const geometry::Screen screen = screen_before(options, head, screen_m);
  return {through(screen, 0.5 * (places[0] + places[1]), head),
          {through(screen, places[0], head), through(screen, places[1], head)},
          screen_m};
}

}  // namespace telesplat::viewer
