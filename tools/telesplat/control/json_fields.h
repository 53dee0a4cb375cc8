// Reads values of a JSON object that another program wrote: a missing value, or one of another type, is empty.
#pragma once

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace telesplat::launcher {

template <class Json>
const Json* field(const Json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto it = object.find(key);
  return it == object.end() ? nullptr : &*it;
}

template <class Json>
std::string text(const Json& object, const char* key) {
  const auto* value = field(object, key);
  return value && value->is_string() ? value->template get<std::string>() : std::string();
}

inline std::optional<double> number(const nlohmann::ordered_json& object, const char* key) {
  const auto* value = field(object, key);
  return value && value->is_number() ? std::optional(value->get<double>()) : std::nullopt;
}

/// Reads a whole number from 0 to 9e15.
inline uint64_t count(const nlohmann::ordered_json& object, const char* key) {
  return uint64_t(std::clamp(number(object, key).value_or(0), 0.0, 9e15));
}

inline bool flag(const nlohmann::ordered_json& object, const char* key) {
  const auto* value = field(object, key);
  return value && value->is_boolean() && value->get<bool>();
}

/// Returns the array's elements; no elements if it is no array.
inline nlohmann::ordered_json array(const nlohmann::ordered_json& object, const char* key) {
  const auto* value = field(object, key);
  return value && value->is_array() ? *value : nlohmann::ordered_json::array();
}

/// Returns the array's elements, if it has `count` numbers.
inline std::optional<std::vector<double>> numbers(const nlohmann::ordered_json& object, const char* key, size_t count) {
  std::vector<double> out;
  for (const auto& v : array(object, key))
    if (v.is_number()) out.push_back(v.get<double>());
  return out.size() == count ? std::optional(out) : std::nullopt;
}

}  // namespace telesplat::launcher
