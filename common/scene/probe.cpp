#include "common/scene/probe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "common/core/utf8.h"
#include "common/geometry/number_text.h"
#include "common/scene/arrays.h"
#include "common/scene/session.h"

namespace telesplat::scene {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kFarthest_m = 1e9;

// Reads `count` numbers separated by commas.
bool read_numbers(std::string_view text, double* out, int count) {
  if (std::count(text.begin(), text.end(), ',') != count - 1) return false;
  for (int i = 0; i < count; ++i) {
    const auto read = number_from<double>(take_until(text, ','));
    if (!read || std::abs(*read) > kFarthest_m) return false;
    out[i] = *read;
  }
  return true;
}

std::string triple(const glm::dvec3& v) { return fmt::format("{},{},{}", v.x, v.y, v.z); }

Json list(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

bool read_vector(const Json& json, const char* key, glm::dvec3& out) {
  const auto found = json.find(key);
  if (found == json.end()) return true;
  if (!found->is_array() || found->size() != 3) return false;
  for (int a = 0; a < 3; ++a) {
    const Json& v = (*found)[size_t(a)];
    if (!v.is_number()) return false;
    out[a] = v.get<double>();
  }
  return true;
}

bool read_number(const Json& json, const char* key, std::optional<double>& out) {
  const auto found = json.find(key);
  if (found == json.end()) return true;
  if (!found->is_number() || !std::isfinite(found->get<double>())) return false;
  out = found->get<double>();
  return true;
}

bool read_name(const Json& json, const char* key, std::string& out) {
  const auto found = json.find(key);
  if (found == json.end()) return true;
  if (!found->is_string() || found->get_ref<const std::string&>().size() > kMaxArrayName ||
      !valid_utf8(found->get_ref<const std::string&>()))
    return false;
  out = found->get<std::string>();
  return true;
}

}  // namespace

std::map<std::string, std::string> to_arguments(const Probe& p) {
  return {{"epoch", std::to_string(p.epoch.value)},
          {"origin", triple(p.origin_room)},
          {"direction", triple(p.direction_room)},
          {"opacity", fmt::format("{}", p.opacity)}};
}

Result<Probe> probe_from(const std::map<std::string, std::string>& arguments) {
  const auto refuse = [&](const char* name, const char* what) {
    return Error{
        fmt::format("probe: {} is \"{}\", not {}", name, value_or(arguments, name, std::string()).substr(0, 80), what)};
  };
  const auto text = [&](const char* name) { return value_or(arguments, name, std::string()); };
  Probe out;
  double v[3], epoch = 0;
  if (!read_numbers(text("epoch"), &epoch, 1) || epoch < 0 || epoch != std::floor(epoch))
    return refuse("epoch", "an epoch's number");
  out.epoch = EpochId{uint64_t(epoch)};
  if (!read_numbers(text("origin"), v, 3)) return refuse("origin", "three numbers of metres in the room");
  out.origin_room = {v[0], v[1], v[2]};
  if (!read_numbers(text("direction"), v, 3)) return refuse("direction", "three numbers");
  const glm::dvec3 direction(v[0], v[1], v[2]);
  if (!(std::abs(glm::length(direction) - 1) < 1e-6)) return refuse("direction", "a direction of unit length");
  out.direction_room = glm::normalize(direction);
  if (!read_numbers(text("opacity"), &out.opacity, 1) || !(out.opacity > 0 && out.opacity <= 1))
    return refuse("opacity", "above 0 and up to 1");
  return out;
}

std::string to_text(const Probed& p) {
  Json json{{"room", list(p.room)}};
  if (glm::length(p.normal_room) > 0) json["normal"] = list(p.normal_room);
  if (p.error_m) json["error_m"] = *p.error_m;
  if (!p.array.empty()) json["array"] = p.array;
  if (!p.array_unit.empty()) json["array_unit"] = p.array_unit;
  if (p.value) json["value"] = *p.value;
  if (p.value_error) json["value_error"] = *p.value_error;
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<Probed> probed_from_text(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  Probed out;
  if (!json.is_object() || !json.contains("room") || !read_vector(json, "room", out.room) ||
      !read_vector(json, "normal", out.normal_room) || !read_number(json, "error_m", out.error_m) ||
      !read_name(json, "array", out.array) || !read_name(json, "array_unit", out.array_unit) ||
      !read_number(json, "value", out.value) || !read_number(json, "value_error", out.value_error))
    return Error{"the data server's answer to a probe is none"};
  return out;
}

}  // namespace telesplat::scene
