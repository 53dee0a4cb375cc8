#include "common/scene/placement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>

#include "common/core/utf8.h"

namespace telesplat::scene {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMaxText = 4000;
constexpr double kLargest = 1e300;

// `count` finite numbers.
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

double scale_of(const glm::dmat4& m) { return std::cbrt(std::abs(glm::determinant(glm::dmat3(m)))); }

}  // namespace

glm::dvec3 Placement::to_data(const glm::dvec3& room) const {
  return glm::inverse(glm::dmat3(data_to_room)) * (room - glm::dvec3(data_to_room[3]));
}

glm::dvec3 Placement::to_room(const glm::dvec3& data) const { return glm::dvec3(data_to_room * glm::dvec4(data, 1)); }

// Normals are turned by the transpose of what turns points from the data to the room.
glm::dvec3 Placement::direction_to_data(const glm::dvec3& room) const {
  const glm::dvec3 out = glm::transpose(glm::dmat3(data_to_room)) * room;
  const double length = glm::length(out);
  return length > 0 ? out / length : room;
}

double Placement::units_per_metre() const { return 1 / scale_of(data_to_room); }

Placement placement_of(const glm::dmat3& rotation, const geometry::DBox& box_data, const geometry::Box& box_room) {
  const glm::dvec3 size = box_data.size(), room = glm::dvec3(box_room.hi) - glm::dvec3(box_room.lo);
  const double largest = std::max({size.x, size.y, size.z});
  const double scale = largest > 0 ? std::max({room.x, room.y, room.z}) / largest : 1;
  const glm::dmat3 turned = rotation * scale;
  const glm::dvec3 centre_room = (glm::dvec3(box_room.lo) + glm::dvec3(box_room.hi)) * 0.5;
  Placement out{.data_to_room = glm::dmat4(turned), .box_data = box_data, .unit = {}};
  out.data_to_room[3] = glm::dvec4(centre_room - turned * (box_data.lo + size * 0.5), 1);
  return out;
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
  if (const auto unit = json.find("unit"); unit != json.end()) {
    if (!unit->is_string() || unit->get_ref<const std::string&>().size() > kMaxUnit ||
        !valid_utf8(unit->get_ref<const std::string&>()))
      return Error{fmt::format("a placement's unit is no UTF-8 text of at most {} bytes", kMaxUnit)};
    out.unit = unit->get<std::string>();
  }
  return out;
}

}  // namespace telesplat::scene
