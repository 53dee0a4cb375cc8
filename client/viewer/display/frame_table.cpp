#include "client/viewer/display/frame_table.h"

#include <algorithm>
#include <cmath>

#include "common/metrics/columns.h"

namespace telesplat::viewer {
namespace {

using F = const MeasuredFrame&;

double angle_deg(const glm::dquat& a, const glm::dquat& b) {
  return 2 * std::acos(std::min(1.0, std::abs(glm::dot(a, b)))) * 180 / 3.14159265358979323846;
}

const glm::dvec3& position(F f) { return f.camera.pose.position_room; }
// Position of the left eye (0) or the right one; without stereo the camera's.
const glm::dvec3& eye(F f, size_t i) {
  return f.stereo.mode == stereo::Mode::kOff ? position(f) : f.stereo.pair.eyes[i].pose.position_room;
}
const glm::dquat& orientation(F f) { return f.camera.pose.orientation; }

// -1: nothing moves in a picture that stands. Clocks of several machines may differ by more than a frame takes.
double motion_to_photon_ms(F f) { return f.drawn.still ? -1.0 : std::max(0.0, (f.seen.at_s - f.posed.taken_s) * 1e3); }

constexpr metrics::Column<MeasuredFrame> kColumns[] = {
    {"frame", [](F f) { return double(f.number); }},
    {"t_s", [](F f) { return f.begin_s - f.start_s; }},
    {"inter_frame_ms", [](F f) { return f.inter_frame_ms(); }},
    {"construction_ms", [](F f) { return (f.end_s - f.begin_s) * 1e3; }},
    {"select_ms", [](F f) { return (f.drawn.chosen_s - f.begin_s) * 1e3; }},
    {"render_ms", [](F f) { return (f.end_s - f.drawn.chosen_s) * 1e3; }},
    {"project_cpu_ms", [](F f) { return f.drawn.stats.project_ms; }},
    {"resolve_cpu_ms", [](F f) { return f.drawn.stats.resolve_ms; }},
    {"fill_cpu_ms", [](F f) { return f.drawn.stats.fill_ms; }},
    {"smooth_cpu_ms", [](F f) { return f.drawn.stats.smooth_ms; }},
    {"antialias_cpu_ms", [](F f) { return f.drawn.stats.antialias_ms; }},
    {"points_selected", [](F f) { return double(f.drawn.selected); }},
    {"points_drawn", [](F f) { return double(f.drawn.drawn); }},
    {"items", [](F f) { return double(f.drawn.items); }},
    {"points_cached", [](F f) { return double(f.drawn.cached); }},
    {"sequence", [](F f) { return double(f.drawn.sequence); }},
    {"update_age_ms", [](F f) { return f.update_age_s * 1e3; }},
    {"view_error_m", [](F f) { return glm::distance(position(f), f.drawn.update.pose.position_room); }},
    {"view_error_deg", [](F f) { return angle_deg(orientation(f), f.drawn.update.pose.orientation); }},
    {"px", [](F f) { return f.head.position_room.x; }},
    {"py", [](F f) { return f.head.position_room.y; }},
    {"pz", [](F f) { return f.head.position_room.z; }},
    {"qw", [](F f) { return f.head.orientation.w; }},
    {"qx", [](F f) { return f.head.orientation.x; }},
    {"qy", [](F f) { return f.head.orientation.y; }},
    {"qz", [](F f) { return f.head.orientation.z; }},
    {"present_ms", [](F f) { return (f.presented_s - f.end_s) * 1e3; }},
    {"detail", [](F f) { return f.drawn.detail; }},
    {"budget_ms", [](F f) { return f.drawn.budget_ms; }},
    {"epoch", [](F f) { return double(f.drawn.epoch.value); }},
    {"wait_ms", [](F f) { return f.wait_s * 1e3; }},
    {"request", [](F f) { return double(f.drawn.update.request.value); }},
    {"buffers_filled", [](F f) { return double(f.filled); }},
    {"summaries", [](F f) { return double(f.drawn.summaries); }},
    {"splat", [](F f) { return double(f.look.render.kernel); }},
    {"finish", [](F f) { return double(splat::finish_bits(f.look.render.finish)); }},
    {"lit", [](F f) { return f.look.lit ? 1.0 : 0.0; }},
    {"begin_s", [](F f) { return f.begin_master_s; }},
    {"refined", [](F f) { return f.drawn.refined.share; }},
    {"refine_ms", [](F f) { return f.drawn.refined.ms; }},
    {"sub_pixels", [](F f) { return double(f.drawn.refined.sub_pixels); }},
    {"coupling", [](F f) { return double(f.coupling.mode); }},
    {"buffers", [](F f) { return double(f.coupling.buffers); }},
    {"head_light", [](F f) { return f.look.head_light ? 1.0 : 0.0; }},
    {"background", [](F f) { return double(f.look.background); }},
    {"wall_frame", [](F f) { return double(f.swap.frame); }},
    {"swap_wait_ms", [](F f) { return f.swap.wait_s * 1e3; }},
    {"swap_skew_ms", [](F f) { return f.swap.skew_s < 0 ? -1.0 : f.swap.skew_s * 1e3; }},
    {"stereo", [](F f) { return double(f.stereo.mode); }},
    {"screen_m", [](F f) { return f.stereo.pair.screen_m; }},
    {"left_x", [](F f) { return eye(f, 0).x; }},
    {"left_y", [](F f) { return eye(f, 0).y; }},
    {"left_z", [](F f) { return eye(f, 0).z; }},
    {"right_x", [](F f) { return eye(f, 1).x; }},
    {"right_y", [](F f) { return eye(f, 1).y; }},
    {"right_z", [](F f) { return eye(f, 1).z; }},
    {"lead_ms", [](F f) { return f.seen.lead_s * 1e3; }},
    {"missed", [](F f) { return double(f.seen.missed); }},
    {"motion_to_photon_ms", motion_to_photon_ms},
    {"predicted_ms", [](F f) { return f.posed.ahead_s * 1e3; }},
    {"refresh_ms", [](F f) { return f.seen.refresh_s * 1e3; }},
    {"still", [](F f) { return f.drawn.still ? 1.0 : 0.0; }},
    {"halved", [](F f) { return f.drawn.halved ? 1.0 : 0.0; }},
};

}  // namespace

int refreshes_missed(double previous_s, double presented_s, double refresh_s) {
  if (previous_s <= 0 || refresh_s <= 0) return 0;
  return std::max(0, int(std::lround((presented_s - previous_s) / refresh_s)) - 1);
}

std::vector<std::string> frame_columns() { return metrics::names(kColumns); }
std::vector<double> frame_row(const MeasuredFrame& frame) { return metrics::values(kColumns, frame); }

}  // namespace telesplat::viewer
