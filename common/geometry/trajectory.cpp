#include "common/geometry/trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

namespace telesplat::geometry {
namespace {

constexpr size_t kMaxSamples = 10'000'000;

// Reads exactly eight numbers separated by commas.
bool parse_row(const std::string& line, double (&out)[8]) {
  const char* p = line.data();
  const char* end = p + line.size();
  for (int i = 0; i < 8; ++i) {
    while (p < end && *p == ' ') ++p;
    const auto [next, error] = std::from_chars(p, end, out[i]);
    if (error != std::errc() || !std::isfinite(out[i])) return false;
    p = next;
    while (p < end && (*p == ' ' || *p == '\r')) ++p;
    if (i < 7 && (p == end || *p++ != ',')) return false;
  }
  return p == end;
}

}  // namespace

Result<Trajectory> Trajectory::read_csv(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  if (!in || !std::getline(in, line)) return Error{fmt::format("{}: cannot be read as a trajectory", path)};
  if (!line.empty() && line.back() == '\r') line.pop_back();
  if (line != "t_s,px,py,pz,qw,qx,qy,qz")
    return Error{fmt::format("{}:1: header is not t_s,px,py,pz,qw,qx,qy,qz", path)};
  Trajectory out;
  for (int number = 2; std::getline(in, line); ++number) {
    if (line.empty() || line == "\r") continue;
    double v[8];
    if (!parse_row(line, v))
      return Error{fmt::format("{}:{}: not eight finite numbers separated by commas", path, number)};
    const glm::dquat q(v[4], v[5], v[6], v[7]);
    if (std::abs(glm::length(q) - 1.0) > 0.05)
      return Error{fmt::format("{}:{}: quaternion has length {:.3f} instead of 1", path, number, glm::length(q))};
    if (!out.samples_.empty() && v[0] <= out.samples_.back().t_s)
      return Error{fmt::format("{}:{}: time {} s is not after {} s", path, number, v[0], out.samples_.back().t_s)};
    if (out.samples_.size() == kMaxSamples) return Error{fmt::format("{}: more than {} samples", path, kMaxSamples)};
    out.samples_.push_back({v[0], {{v[1], v[2], v[3]}, glm::normalize(q)}});
  }
  if (out.samples_.empty()) return Error{fmt::format("{}: holds no samples", path)};
  return out;
}

Trajectory Trajectory::orbit(double radius_m, double height_m, double period_s) {
  Trajectory out;
  out.orbit_radius_m_ = radius_m;
  out.orbit_height_m_ = height_m;
  out.orbit_period_s_ = period_s;
  return out;
}

Trajectory Trajectory::still(const Pose& pose) {
  Trajectory out;
  out.samples_.push_back({0.0, pose});
  return out;
}

Pose Trajectory::at(double t_s) const {
  if (samples_.empty()) {
    const double angle = t_s / orbit_period_s_ * 2.0 * 3.14159265358979323846;
    return look_at({orbit_radius_m_ * std::sin(angle), orbit_height_m_, orbit_radius_m_ * std::cos(angle)},
                   glm::dvec3(0));
  }
  // Sample times count from the first one.
  const double t = t_s + samples_.front().t_s;
  const auto after =
      std::upper_bound(samples_.begin(), samples_.end(), t, [](double v, const Sample& s) { return v < s.t_s; });
  if (after == samples_.begin()) return samples_.front().pose;
  if (after == samples_.end()) return samples_.back().pose;
  const Sample &a = *(after - 1), &b = *after;
  const double f = (t - a.t_s) / (b.t_s - a.t_s);
  return {glm::mix(a.pose.position_room, b.pose.position_room, f),
          glm::normalize(glm::slerp(a.pose.orientation, b.pose.orientation, f))};
}

double Trajectory::duration_s() const { return samples_.empty() ? 0.0 : samples_.back().t_s - samples_.front().t_s; }

Pose look_at(const glm::dvec3& eye, const glm::dvec3& target) {
  const glm::dvec3 back = glm::normalize(eye - target);
  const glm::dvec3 up = std::abs(back.y) > 0.999 ? glm::dvec3(0, 0, -1) : glm::dvec3(0, 1, 0);
  const glm::dvec3 right = glm::normalize(glm::cross(up, back));
  return {eye, glm::normalize(glm::quat_cast(glm::dmat3(right, glm::cross(back, right), back)))};
}

Pose default_pose() { return look_at({0.0, 0.4, 0.62}, {0.0, 0.0, 0.0}); }

}  // namespace telesplat::geometry
