#include "client/viewer/input/head_movement.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "common/geometry/fit.h"

namespace telesplat::viewer {
namespace {

constexpr double kFarthest_m = 1e5;

}  // namespace

geometry::Pose HeadMovement::first_view(const geometry::Box& box, const geometry::Camera& frustum,
                                        double middle_x) const {
  if (!eye) return geometry::fitted_view(box, frustum, middle_x);
  return geometry::look_at(*eye, look_at.value_or((glm::dvec3(box.lo) + glm::dvec3(box.hi)) * 0.5));
}

geometry::Trajectory HeadMovement::trajectory(const geometry::Box& box, const geometry::Camera& frustum) const {
  if (recorded) return *recorded;
  if (orbits) return geometry::fitted_orbit(box, frustum);
  return geometry::Trajectory::still(first_view(box, frustum));
}

Result<HeadMovement> head_movement(const std::string& name, bool loop) {
  HeadMovement out;
  out.orbits = name == "orbit";
  if (out.orbits || name == "still") {
    if (loop) return Error{fmt::format("--loop: --trajectory {} has no end to begin again at; a file has", name)};
    return out;
  }
  auto recorded = geometry::Trajectory::read_csv(name);
  if (!recorded) return Error{"--trajectory " + recorded.error().text};
  if (loop) recorded->repeat();
  out.recorded = std::make_shared<const geometry::Trajectory>(std::move(*recorded));
  return out;
}

Result<glm::dvec3> parse_point(const std::string& text) {
  const Error wrong{"not three numbers x,y,z (metres in the room, +y up)"};
  glm::dvec3 out(0.0);
  const char *p = text.data(), *end = p + text.size();
  for (int i = 0; i < 3; ++i) {
    while (p < end && *p == ' ') ++p;
    if (p < end && *p == '+') ++p;
    const auto [next, error] = std::from_chars(p, end, out[i]);
    if (error != std::errc()) return wrong;
    for (p = next; p < end && *p == ' ';) ++p;
    if (i < 2 && (p == end || *p++ != ',')) return wrong;
  }
  if (p != end) return wrong;
  for (int i = 0; i < 3; ++i)
    if (!(std::abs(out[i]) <= kFarthest_m))
      return Error{fmt::format("{} is not within {} m of the room's centre", out[i], kFarthest_m)};
  return out;
}

}  // namespace telesplat::viewer
