#include "common/scene/placement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <iterator>
#include <nlohmann/json.hpp>

#include "common/core/utf8.h"

namespace telesplat::scene {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMaxText = 4000;
constexpr double kLargest = 1e300;

// Reads `count` finite numbers.
Result<std::vector<double>> read_numbers(const Json& json, const char* key, size_t count) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_array() || found->size() != count)
    return Error{fmt::format("a placement's \"{}\" is no list of {} numbers", key, count)};
  std::vector<double> out;
  for (const Json& v : *found) {
    if (!v.is_number() || !(std::abs(v.get<double>()) <= kLargest))
      return Error{fmt::format("a placement's \"{}\" has what is no number within +-{:g}", key, kLargest)};
    out.push_back(v.get<double>());
  }
  return out;
}

constexpr const char* kSpaces[] = {"plain", "LPS", "RAS", "projected", "geographic"};

bool short_utf8(const Json& json, const char* key, size_t most, std::string& out) {
  const auto found = json.find(key);
  if (found == json.end()) return true;
  if (!found->is_string() || found->get_ref<const std::string&>().size() > most ||
      !valid_utf8(found->get_ref<const std::string&>()))
    return false;
  out = found->get<std::string>();
  return true;
}

Json to_json(const Coordinates& c) {
  return {{"space", kSpaces[int(c.space)]},
          {"reference", c.reference.substr(0, kMaxReference)},
          {"unit", c.unit.substr(0, kMaxUnit)},
          {"height_unit", c.height_unit.substr(0, kMaxUnit)},
          {"shown", {c.shown.x, c.shown.y, c.shown.z}},
          {"lengths", {c.lengths.x, c.lengths.y, c.lengths.z}}};
}

Result<Coordinates> coordinates_from(const Json& json) {
  Coordinates out;
  std::string space;
  if (!json.is_object() || !short_utf8(json, "space", kMaxUnit, space) ||
      !short_utf8(json, "reference", kMaxReference, out.reference) || !short_utf8(json, "unit", kMaxUnit, out.unit) ||
      !short_utf8(json, "height_unit", kMaxUnit, out.height_unit))
    return Error{"a placement's coordinates are no object of short UTF-8 texts"};
  const auto named = std::find(std::begin(kSpaces), std::end(kSpaces), space);
  if (named == std::end(kSpaces)) return Error{fmt::format("a placement's space is \"{}\"", space)};
  out.space = Space(named - std::begin(kSpaces));
  const auto shown = read_numbers(json, "shown", 3), lengths = read_numbers(json, "lengths", 3);
  if (!shown) return shown.error();
  if (!lengths) return lengths.error();
  for (int a = 0; a < 3; ++a) {
    out.shown[a] = (*shown)[size_t(a)], out.lengths[a] = (*lengths)[size_t(a)];
    if (out.shown[a] == 0 || out.lengths[a] == 0) return Error{"a placement's coordinates are scaled by 0"};
  }
  return out;
}

// Number of digits after the point, so that the last one is a millionth of the data's size.
int digits_of(const Placement& p, int axis) {
  const double size = p.box_data.empty() ? 1 : p.box_data.size()[axis];
  const int digits = size > 0 ? std::clamp(6 - int(std::ceil(std::log10(size))), 0, 12) : 6;
  const Space space = p.coordinates.space;
  if (space == Space::kGeographic) return axis < 2 ? std::max(digits, 7) : std::max(digits, 3);
  return space == Space::kProjected ? std::max(digits, 3) : digits;
}

std::string with_unit(const std::string& text, const std::string& unit) {
  return unit.empty() ? text : text + " " + unit;
}

double scale_of(const glm::dmat4& m) { return std::cbrt(std::abs(glm::determinant(glm::dmat3(m)))); }

}  // namespace

glm::dvec3 Placement::to_data(const glm::dvec3& room) const {
  return glm::inverse(glm::dmat3(data_to_room)) * (room - glm::dvec3(data_to_room[3]));
}

// Normals are turned by the transpose of the matrix that turns points to the room, and scaled to lengths.
glm::dvec3 Placement::direction_to_data(const glm::dvec3& room) const {
  const glm::dvec3 out = glm::transpose(glm::dmat3(data_to_room)) * room / coordinates.lengths;
  const double length = glm::length(out);
  return length > 0 ? out / length : room;
}

// Uses the radii of curvature along the meridian and across it, at the latitude in the middle.
glm::dvec3 Placement::way(const glm::dvec3& from_data, const glm::dvec3& to_data) const {
  const glm::dvec3 along = to_data - from_data;
  if (coordinates.space != Space::kGeographic) return along * coordinates.lengths;
  constexpr double kEquator_m = 6378137, kEccentricity2 = 0.00669437999014;
  const double latitude = glm::radians((from_data.y + to_data.y) / 2), sine = std::sin(latitude);
  const double w2 = 1 - kEccentricity2 * sine * sine, across_m = kEquator_m / std::sqrt(w2);
  return {glm::radians(std::remainder(along.x, 360)) * across_m * std::cos(latitude),
          glm::radians(along.y) * across_m * (1 - kEccentricity2) / w2, along.z * coordinates.lengths.z};
}

double Placement::length_of(const glm::dvec3& room) const {
  return glm::length(glm::inverse(glm::dmat3(data_to_room)) * room * coordinates.lengths);
}

Placement placement_of(const glm::dmat3& rotation, const geometry::DBox& box_data, const geometry::Box& box_room,
                       const Coordinates& coordinates) {
  const glm::dvec3 size = box_data.size(), room = glm::dvec3(box_room.hi) - glm::dvec3(box_room.lo);
  const double largest = std::max({size.x, size.y, size.z});
  const double scale = largest > 0 ? std::max({room.x, room.y, room.z}) / largest : 1;
  const glm::dmat3 turned = rotation * scale;
  const glm::dvec3 centre_room = (glm::dvec3(box_room.lo) + glm::dvec3(box_room.hi)) * 0.5;
  Placement out{.data_to_room = glm::dmat4(turned), .coordinates = coordinates};
  for (int axis = 0; axis < 3; ++axis) out.data_to_room[axis] *= coordinates.shown[axis];
  out.data_to_room[3] = glm::dvec4(centre_room - turned * (box_data.lo + size * 0.5), 1);
  out.box_data.extend(box_data.lo / coordinates.shown);
  out.box_data.extend(box_data.hi / coordinates.shown);
  return out;
}

const char* axis_letters(Space space) {
  switch (space) {
    case Space::kLps:
    case Space::kRas:
      return kSpaces[int(space)];
    case Space::kProjected:
    case Space::kGeographic:
      return "ENz";
    case Space::kPlain:
      break;
  }
  return "xyz";
}

std::string place_text(const Placement& p, const glm::dvec3& data) {
  const auto number = [&](int axis, double value) { return fmt::format("{:.{}f}", value + 0.0, digits_of(p, axis)); };
  const Coordinates& c = p.coordinates;
  const std::string x = number(0, data.x), y = number(1, data.y), z = number(2, data.z);
  const std::string reference = c.reference.empty() ? "" : " (" + c.reference + ")";
  switch (c.space) {
    case Space::kLps:
    case Space::kRas: {
      const double right = c.space == Space::kRas ? data.x : -data.x, front = c.space == Space::kRas ? data.y : -data.y;
      const auto side = [&](int axis, double value, char above, char below) {
        return fmt::format("{} {}", value < 0 ? below : above, number(axis, std::abs(value)));
      };
      return with_unit(fmt::format("{}  {}  {}", side(0, right, 'R', 'L'), side(1, front, 'A', 'P'),
                                   side(2, data.z, 'S', 'I')),
                       p.unit) +
             fmt::format(" ({} {}, {}, {})", kSpaces[int(c.space)], x, y, z);
    }
    case Space::kGeographic:
      return fmt::format("lon {}, lat {}, height ", x, y) + with_unit(z, c.height_unit) + reference;
    case Space::kProjected:
      return with_unit(fmt::format("x {}, y {}", x, y), c.unit) + ", height " + with_unit(z, c.height_unit) + reference;
    case Space::kPlain:
      break;
  }
  return with_unit(fmt::format("{}, {}, {}", x, y, z), p.unit);
}

std::string to_text(const Coordinates& c) { return to_json(c).dump(-1, ' ', false, Json::error_handler_t::replace); }

Result<Coordinates> coordinates_from_text(std::string_view text) {
  return coordinates_from(Json::parse(text, nullptr, false));
}

std::string to_text(const Placement& p) {
  Json matrix = Json::array();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) matrix.push_back(p.data_to_room[column][row]);
  Json json{{"matrix", std::move(matrix)}};
  if (!p.box_data.empty()) {
    json["lo"] = {p.box_data.lo.x, p.box_data.lo.y, p.box_data.lo.z};
    json["hi"] = {p.box_data.hi.x, p.box_data.hi.y, p.box_data.hi.z};
  }
  if (!p.unit.empty()) json["unit"] = p.unit.substr(0, kMaxUnit);
  if (!(p.coordinates == Coordinates{})) json["coordinates"] = to_json(p.coordinates);
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<Placement> placement_from_text(std::string_view text) {
  if (text.size() > kMaxText) return Error{fmt::format("a placement of {} bytes, limit {}", text.size(), kMaxText)};
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return Error{"what should be a placement is no JSON object"};
  const auto matrix = read_numbers(json, "matrix", 12);
  if (!matrix) return matrix.error();
  Placement out;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) out.data_to_room[column][row] = (*matrix)[size_t(4 * row + column)];
  if (const double scale = scale_of(out.data_to_room); !(scale > 1e-100 && scale < 1e100))
    return Error{fmt::format("a placement's scale is {}, outside [1e-100, 1e100]", scale)};
  if (json.contains("lo") || json.contains("hi")) {
    const auto lo = read_numbers(json, "lo", 3), hi = read_numbers(json, "hi", 3);
    if (!lo) return lo.error();
    if (!hi) return hi.error();
    out.box_data = {{(*lo)[0], (*lo)[1], (*lo)[2]}, {(*hi)[0], (*hi)[1], (*hi)[2]}};
    if (out.box_data.empty()) return Error{"a placement's box ends before it begins"};
  }
  if (!short_utf8(json, "unit", kMaxUnit, out.unit))
    return Error{fmt::format("a placement's unit is no UTF-8 text of at most {} bytes", kMaxUnit)};
  if (const auto found = json.find("coordinates"); found != json.end()) {
    auto coordinates = coordinates_from(*found);
    if (!coordinates) return coordinates.error();
    out.coordinates = *std::move(coordinates);
  }
  return out;
}

}  // namespace telesplat::scene
