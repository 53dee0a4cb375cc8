#include "common/scene/told_place.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <nlohmann/json.hpp>

namespace telesplat::scene {
namespace {

using Json = nlohmann::ordered_json;

Json coordinates(const glm::dvec3& v) { return {v.x + 0.0, v.y + 0.0, v.z + 0.0}; }

std::optional<double> number_of(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
}
std::string text(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}
std::optional<glm::dvec3> vector(const Json& json, const char* key) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_array() || found->size() != 3) return std::nullopt;
  glm::dvec3 out;
  for (int a = 0; a < 3; ++a) {
    if (!(*found)[size_t(a)].is_number()) return std::nullopt;
    out[a] = (*found)[size_t(a)].get<double>();
  }
  return out;
}

// Writes a value with one digit more than its bound's first, and the bound with two digits, without exponent if short.
std::string bounded(double value, double error) {
  if (!(error > 0)) return fmt::format("{:.9g}", value);
  const int digits = std::clamp(1 - int(std::floor(std::log10(error))), 0, 12);
  return fmt::format("{:.{}f} +- {:.9g}", value, digits, std::strtod(fmt::format("{:.2g}", error).c_str(), nullptr));
}

}  // namespace

void refine(ToldPlace& place, const Probed& probed, const Placement& placement) {
  place.room = probed.room;
  place.data = placement.to_data(probed.room);
  place.estimate.clear();
  place.error.reset();
  if (const double room_m = glm::length(probed.normal_room); room_m > 0)
    place.normal_data = placement.direction_to_data(probed.normal_room);
  // Uses the axis of the room along which the data are largest, so that the bound holds in all directions.
  if (probed.error_m) {
    double most = 0;
    for (int a = 0; a < 3; ++a) {
      glm::dvec3 axis(0);
      axis[a] = 1;
      most = std::max(most, placement.length_of(axis));
    }
    place.error = *probed.error_m * most;
  }
  place.array = probed.array, place.array_unit = probed.array_unit;
  place.value = probed.value, place.value_error = probed.value_error;
}

nlohmann::ordered_json to_json(const ToldPlace& p, const Placement& placement) {
  Json out{{"place", place_text(placement, p.data)},
           {"room", coordinates(p.room)},
           {"data", coordinates(p.data)},
           {"unit", placement.unit}};
  if (glm::length(p.normal_data) > 0) out["normal"] = coordinates(p.normal_data);
  if (p.error) out["error"] = *p.error;
  if (!p.estimate.empty()) out["estimate"] = p.estimate;
  if (!p.array.empty()) out["array"] = p.array;
  if (!p.array_unit.empty()) out["array_unit"] = p.array_unit;
  if (p.value) out["value"] = *p.value;
  if (p.value_error) out["value_error"] = *p.value_error;
  return out;
}

std::optional<ToldPlace> told_place_from(const nlohmann::ordered_json& json, const Placement& placement) {
  const auto room = json.is_object() ? vector(json, "room") : std::nullopt;
  if (!room) return std::nullopt;
  ToldPlace out{.room = *room, .data = vector(json, "data").value_or(placement.to_data(*room))};
  out.normal_data = vector(json, "normal").value_or(glm::dvec3(0));
  out.error = number_of(json, "error");
  out.estimate = text(json, "estimate");
  out.array = text(json, "array"), out.array_unit = text(json, "array_unit");
  out.value = number_of(json, "value"), out.value_error = number_of(json, "value_error");
  return out;
}

std::string value_text(const ToldPlace& p) {
  if (!p.value) return {};
  const std::string number = p.value_error ? bounded(*p.value, *p.value_error) : fmt::format("about {:.4g}", *p.value);
  return fmt::format("{}{}{}{}", p.array, p.array.empty() ? "" : " ", number,
                     p.array_unit.empty() ? "" : " " + p.array_unit);
}

std::string length_text(double length, const std::string& unit) {
  return fmt::format("{:.6g}{}{}", length, unit.empty() ? "" : " ", unit);
}

Measured measure(std::span<const ToldPlace> places, const Placement& placement) {
  Measured out;
  for (size_t i = 1; i < places.size(); ++i) {
    const glm::dvec3 on = placement.way(places[i - 1].data, places[i].data);
    out.distances.push_back(glm::length(on));
    if (i < 2) continue;
    const glm::dvec3 back = placement.way(places[i - 1].data, places[i - 2].data);
    out.angles_deg.push_back(glm::length(on) > 0 && glm::length(back) > 0
                                 ? glm::degrees(std::atan2(glm::length(glm::cross(back, on)), glm::dot(back, on)))
                                 : std::numeric_limits<double>::quiet_NaN());
  }
  return out;
}

}  // namespace telesplat::scene
