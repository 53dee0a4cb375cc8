#include "common/scene/clip_order.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <optional>

namespace telesplat::scene {
namespace {

constexpr double kMaxNumber = 1e30;
constexpr const char* kForms =
    "plane x>=VALUE, plane x<=VALUE (x, y or z), plane A,B,C,D, box X0,Y0,Z0,X1,Y1,Z1 or off";

struct Number {
  double value = 0;
  bool percent = false;
};

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

std::optional<Number> scalar_or_percent(std::string_view text) {
  text = trimmed(text);
  Number out;
  if (text.ends_with('%')) out.percent = true, text.remove_suffix(1);
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto read = std::from_chars(text.data(), text.data() + text.size(), out.value);
  if (text.empty() || read.ec != std::errc() || read.ptr != text.data() + text.size()) return std::nullopt;
  if (!(std::abs(out.value) <= kMaxNumber)) return std::nullopt;
  return out;
}

// Reads `count` numbers, separated by commas.
std::optional<std::vector<Number>> numbers(std::string_view text, size_t count) {
  std::vector<Number> out;
  for (;;) {
    const size_t comma = text.find(',');
    const auto one = scalar_or_percent(text.substr(0, comma));
    if (!one || out.size() == count) return std::nullopt;
    out.push_back(*one);
    if (comma == text.npos) break;
    text.remove_prefix(comma + 1);
  }
  return out.size() == count ? std::optional(out) : std::nullopt;
}

glm::dvec3 along(int axis, double sign) {
  glm::dvec3 out(0);
  out[axis] = sign;
  return out;
}

// Keeps the part of an axis from the number on, or up to it.
ClipOrder::Plane on_axis(int axis, bool from, const Number& n) {
  return {along(axis, from ? 1 : -1), from ? n.value : -n.value, n.percent};
}

bool read_plane(std::string_view text, ClipOrder& out) {
  const std::string_view axes = "xyz";
  if (text.size() > 3 && axes.find(text[0]) != axes.npos) {
    std::string_view rest = trimmed(text.substr(1));
    const bool from = rest.starts_with(">=");
    if (!from && !rest.starts_with("<=")) return false;
    const auto n = scalar_or_percent(rest.substr(2));
    if (n) out.planes.push_back(on_axis(int(axes.find(text[0])), from, *n));
    return n.has_value();
  }
  const auto four = numbers(text, 4);
  if (!four) return false;
  for (const Number& n : *four)
    if (n.percent) return false;
  const glm::dvec3 normal((*four)[0].value, (*four)[1].value, (*four)[2].value);
  if (!(glm::length(normal) > 0)) return false;
  out.planes.push_back({normal, (*four)[3].value});
  return true;
}

Result<bool> read_box(std::string_view text, ClipOrder& out) {
  const auto six = numbers(text, 6);
  if (!six) return false;
  for (size_t axis = 0; axis < 3; ++axis) {
    const Number &lo = (*six)[axis], &hi = (*six)[axis + 3];
    if (lo.percent == hi.percent && !(lo.value < hi.value))
      return Error{
          fmt::format("clip: a box from {} to {} on the {} axis has nothing in it", lo.value, hi.value, "xyz"[axis])};
    out.planes.push_back(on_axis(int(axis), true, lo));
    out.planes.push_back(on_axis(int(axis), false, hi));
  }
  return true;
}

// Converts shares of the box to numbers.
Result<double> value_of(const ClipOrder::Plane& plane, const Placement& placement) {
  if (!plane.percent) return plane.value;
  if (placement.box_data.empty())
    return Error{"clip: a percentage is of the data's box, and the data server does not tell of one: give numbers"};
  const glm::dvec3 towards = glm::abs(plane.normal);
  const double lo = glm::dot(towards, placement.box_data.lo), hi = glm::dot(towards, placement.box_data.hi);
  const bool from = plane.normal.x + plane.normal.y + plane.normal.z > 0;
  return from ? lo + (hi - lo) * plane.value / 100 : -(lo + (hi - lo) * -plane.value / 100);
}

}  // namespace

Result<ClipOrder> parse_clip(std::string_view text) {
  ClipOrder out;
  if (text.size() > kMaxClipOrder)
    return Error{fmt::format("clip: an order of {} bytes, limit {}", text.size(), kMaxClipOrder)};
  if (trimmed(text) == "off" || trimmed(text).empty()) return out;
  for (;;) {
    const size_t end = text.find(';');
    const std::string_view part = trimmed(text.substr(0, end));
    Result<bool> read = false;
    if (part.starts_with("plane "))
      read = read_plane(trimmed(part.substr(6)), out);
    else if (part.starts_with("box "))
      read = read_box(trimmed(part.substr(4)), out);
    if (!read) return read.error();
    if (!*read) return Error{fmt::format("clip: \"{}\" is none of {}", part.substr(0, 80), kForms)};
    if (end == text.npos) break;
    text.remove_prefix(end + 1);
  }
  if (out.planes.size() > geometry::Clip::kMostPlanes)
    return Error{
        fmt::format("clip: {} planes, limit {} (a box has six)", out.planes.size(), geometry::Clip::kMostPlanes)};
  return out;
}

// A point p of the data is kept if n . p >= d. With p = A^-1 (r - t) for a point r in the room: (A^-T n) . r >= d +
// (A^-T n) . t.
Result<geometry::Clip> place_clip(const ClipOrder& order, const Placement& placement) {
  geometry::Clip out;
  const glm::dmat3 turn = glm::transpose(glm::inverse(glm::dmat3(placement.data_to_room)));
  const glm::dvec3 origin(placement.data_to_room[3]);
  for (const ClipOrder::Plane& plane : order.planes) {
    const auto value = value_of(plane, placement);
    if (!value) return value.error();
    const glm::dvec3 normal = turn * plane.normal;
    const double length = glm::length(normal), offset = (*value + glm::dot(normal, origin)) / length;
    if (!(length > 0) || !(std::abs(offset) <= 1e9))
      return Error{fmt::format("clip: a plane at {:g} lies too far from the data", *value)};
    out.planes.push_back({normal / length, offset});
  }
  return out;
}

}  // namespace telesplat::scene
