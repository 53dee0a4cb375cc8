#include "client/stereo/autostereo/line_screen.h"

#include <fmt/format.h>

#include <cmath>
#include <glm/geometric.hpp>

namespace telesplat::stereo {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr int kSteps = 4;  // of Newton's method; the first guess is the paraxial one

}  // namespace

Status validate(const LineScreen& s) {
  const auto limits = [](const char* name, double value, double least, double most) -> Status {
    if (value >= least && value <= most) return ok_status();
    return Error{fmt::format("{} is {}, limits are {} and {}", name, value, least, most)};
  };
  for (const auto& good : {limits("pitch_mm", s.pitch_m * 1e3, 0.01, 100), limits("tilt_deg", s.tilt_deg, -60, 60),
                           limits("shift_mm", s.shift_m * 1e3, -1e4, 1e4), limits("gap_mm", s.gap_m * 1e3, 0, 1000),
                           limits("thickness_mm", s.thickness_m * 1e3, 0, 1000), limits("index", s.index, 1, 3),
                           limits("opening", s.opening, 0.01, 0.9), limits("guard", s.guard, 0, 0.49)})
    if (!good) return good;
  if (s.gap_m + s.thickness_m <= 0)
    return Error{"gap_mm and thickness_mm are both 0: lines that lie in the pixels part nothing"};
  return ok_status();
}

glm::dvec2 through(const LineScreen& s, const glm::dvec3& eye, const glm::dvec2& place) {
  const glm::dvec2 aside = glm::dvec2(eye) - place;
  const double distance = glm::length(aside), air_m = eye.z - s.thickness_m;
  // tan: of the ray's angle in air. In the plate sin is 1 / index of that in air, so its tangent is
  // tan / sqrt(index^2 + (index^2 - 1) tan^2).
  const double n2 = s.index * s.index;
  double tangent = distance / (air_m + s.thickness_m / s.index);
  for (int i = 0; i < kSteps; ++i) {
    const double root = std::sqrt(n2 + (n2 - 1) * tangent * tangent);
    const double reached = air_m * tangent + s.thickness_m * tangent / root;
    const double slope = air_m + s.thickness_m * n2 / (root * root * root);
    tangent -= (reached - distance) / slope;
  }
  const double behind_m = s.gap_m * tangent + s.thickness_m * tangent / std::sqrt(n2 + (n2 - 1) * tangent * tangent);
  return distance > 0 ? place + aside * (behind_m / distance) : place;
}

double line_at(const LineScreen& s, const glm::dvec2& p) {
  const double tilt = s.tilt_deg * kDegree;
  return (p.x * std::cos(tilt) + p.y * std::sin(tilt) - s.shift_m) / s.pitch_m;
}

double off_line(double line) { return std::abs(line - std::nearbyint(line)); }

double optical_depth_m(const LineScreen& s) { return s.gap_m + s.thickness_m / s.index; }

Shown whose(const LineScreen& s, double left_off, double right_off) {
  if (std::abs(left_off - right_off) < s.guard) return Shown::kNothing;
  return left_off <= right_off ? Shown::kLeft : Shown::kRight;
}

}  // namespace telesplat::stereo
