#include "client/wall/keys.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "common/core/nearest.h"

namespace telesplat::wall {

void Keys::refuse(const char* key, const std::string& what) {
  if (!error_.empty()) return;
  const toml::node* node = table_.get(key);
  const auto line = node ? node->source().begin.line : table_.source().begin.line;
  error_ = fmt::format("{}:{}: {} {}: {}", path_, line, where_, key, what);
}

void Keys::require(const char* key) {
  if (!has(key)) refuse(key, "is missing");
}

std::string Keys::text(const char* key, const std::string& fallback) {
  taken_.insert(key);
  const toml::node* node = table_.get(key);
  if (!node) return fallback;
  if (const auto* value = node->as_string()) return **value;
  refuse(key, "is no text");
  return fallback;
}

double Keys::number(const char* key, double fallback, double least, double most) {
  taken_.insert(key);
  const toml::node* node = table_.get(key);
  if (!node) return fallback;
  const auto value = node->is_number() ? node->value<double>() : std::nullopt;
  if (!value)
    refuse(key, "is no number");
  else if (!(*value >= least && *value <= most))
    refuse(key, fmt::format("{} is outside {}..{}", *value, least, most));
  else
    return *value;
  return fallback;
}

int Keys::whole(const char* key, int fallback, int least, int most) {
  const double value = number(key, fallback, least, most);
  if (value == std::floor(value)) return int(value);
  refuse(key, fmt::format("{} is no whole number", value));
  return fallback;
}

std::vector<double> Keys::list(const char* key, std::vector<double> fallback, size_t least_count, size_t most_count,
                               double least, double most) {
  taken_.insert(key);
  const toml::node* node = table_.get(key);
  if (!node) return fallback;
  if (least_count == 1 && node->is_number()) return {number(key, fallback[0], least, most)};
  const toml::array* array = node->as_array();
  const auto how_many = least_count == most_count ? fmt::format("{} numbers", most_count)
                                                  : fmt::format("{} or {} numbers", least_count, most_count);
  if (!array || (array->size() != least_count && array->size() != most_count)) {
    refuse(key, "is not a list of " + how_many);
    return fallback;
  }
  std::vector<double> out;
  for (const toml::node& element : *array) {
    const auto value = element.is_number() ? element.value<double>() : std::nullopt;
    if (!value) {
      refuse(key, "is not a list of " + how_many);
      return fallback;
    }
    if (!(*value >= least && *value <= most)) {
      refuse(key, fmt::format("{} is outside {}..{}", *value, least, most));
      return fallback;
    }
    out.push_back(*value);
  }
  return out;
}

Status Keys::done() {
  for (const auto& [key, node] : table_) {
    const std::string name(key.str());
    if (taken_.contains(name)) continue;
    const std::vector<std::string_view> known(taken_.begin(), taken_.end());
    const auto meant = nearest_word(name, known);
    refuse(name.c_str(), meant ? fmt::format("is no key here; did you mean {}?", *meant) : "is no key here");
  }
  return error_.empty() ? ok_status() : Status(Error{error_});
}

}  // namespace telesplat::wall
