#include "common/geometry/clip.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace telesplat::geometry {
namespace {

constexpr double kLargest = 1e9;
// A line less inclined to a plane counts as parallel.
constexpr double kParallel = 1e-12;

// Takes the next number off a text, with the blanks before it; NaN: no number follows.
double take_number(std::string_view& text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec != std::errc()) return std::numeric_limits<double>::quiet_NaN();
  text.remove_prefix(size_t(read.ptr - text.data()));
  return value;
}

Result<ClipPlane> read_plane(std::string_view text) {
  const std::string whole(text.substr(0, 80));
  double v[4];
  for (double& number : v) {
    number = take_number(text);
    if (!(std::abs(number) <= kLargest))
      return Error{fmt::format("a clip plane is \"{}\" instead of four numbers up to {:g}", whole, kLargest)};
  }
  if (!text.empty()) return Error{fmt::format("a clip plane is \"{}\" instead of four numbers", whole)};
  const ClipPlane plane{{v[0], v[1], v[2]}, v[3]};
  if (const double length = glm::length(plane.normal); std::abs(length - 1) > 1e-6)
    return Error{fmt::format("a clip plane's normal has the length {}, not 1", length)};
  return plane;
}

}  // namespace

bool Clip::keeps(const glm::dvec3& room, double tolerance_m) const {
  return std::all_of(planes.begin(), planes.end(),
                     [&](const ClipPlane& p) { return p.inside_m(room) >= -tolerance_m; });
}

Clip::Part Clip::part_of(const Box& box_room) const {
  const glm::dvec3 lo(box_room.lo), hi(box_room.hi), centre = (lo + hi) * 0.5, half = (hi - lo) * 0.5;
  Part out = Part::kAll;
  for (const ClipPlane& plane : planes) {
    const double inside_m = plane.inside_m(centre), reach_m = glm::dot(glm::abs(plane.normal), half);
    if (inside_m < -reach_m) return Part::kNone;
    if (inside_m < reach_m) out = Part::kSome;
  }
  return out;
}

Clip::Stretch Clip::Stretch::within(const DBox& box, const glm::dvec3& origin, const glm::dvec3& direction) const {
  Stretch out = *this;
  for (int a = 0; a < 3; ++a) {
    const double lo = box.lo[a] - origin[a], hi = box.hi[a] - origin[a], on = direction[a];
    if (on == 0 && (lo > 0 || hi < 0)) return {1, 0};
    if (on != 0) out = {std::max(out.begin, std::min(lo / on, hi / on)), std::min(out.end, std::max(lo / on, hi / on))};
  }
  return out;
}

Clip::Stretch Clip::stretch(const glm::dvec3& origin_room, const glm::dvec3& direction) const {
  Stretch out{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  const double length = glm::length(direction);
  for (const ClipPlane& plane : planes) {
    const double towards = glm::dot(plane.normal, direction), inside_m = plane.inside_m(origin_room);
    if (std::abs(towards) <= kParallel * length) {
      if (inside_m < 0) return {1, 0};
    } else if (towards > 0) {
      out.begin = std::max(out.begin, -inside_m / towards);
    } else {
      out.end = std::min(out.end, -inside_m / towards);
    }
  }
  return out;
}

std::string to_text(const Clip& clip) {
  std::string out;
  for (const ClipPlane& p : clip.planes)
    out += fmt::format("{}{} {} {} {}", out.empty() ? "" : ";", p.normal.x, p.normal.y, p.normal.z, p.offset);
  return out;
}

Result<Clip> clip_from_text(std::string_view text) {
  Clip out;
  while (!text.empty()) {
    if (out.planes.size() == Clip::kMostPlanes)
      return Error{fmt::format("a clip of more than {} planes", Clip::kMostPlanes)};
    const size_t end = std::min(text.find(';'), text.size());
    const auto plane = read_plane(text.substr(0, end));
    if (!plane) return plane.error();
    out.planes.push_back(*plane);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

}  // namespace telesplat::geometry
