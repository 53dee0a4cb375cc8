// Takes keys from one table of a wall's description, each with its limits. Keys that were never taken are refused.
// Private to this library.
#pragma once

#include <toml++/toml.h>
#include <array>
#include <set>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::wall {

class Keys {
 public:
  /// where: "[wall]", "[[planar]] 2", for messages.
  Keys(const toml::table& table, std::string path, std::string where)
      : table_(table), path_(std::move(path)), where_(std::move(where)) {}

  bool has(const char* key) const { return table_.contains(key); }
  /// The first error stays; values that are taken after it mean nothing.
  std::string text(const char* key, const std::string& fallback);
  double number(const char* key, double fallback, double least, double most);
  int whole(const char* key, int fallback, int least, int most);
  template <size_t N>
  std::array<double, N> numbers(const char* key, const std::array<double, N>& fallback, double least, double most) {
    std::array<double, N> out = fallback;
    const auto values = list(key, {fallback.begin(), fallback.end()}, N, N, least, most);
    for (size_t i = 0; i < N && i < values.size(); ++i) out[i] = values[i];
    return out;
  }
  /// Takes a list of `least_count` or `most_count` numbers; a list of one may be written as the number alone.
  std::vector<double> list(const char* key, std::vector<double> fallback, size_t least_count, size_t most_count,
                           double least, double most);
  /// Refuses the table if it does not have the key.
  void require(const char* key);
  /// Refuses the table: "PATH:LINE: WHERE KEY: what".
  void refuse(const char* key, const std::string& what);
  /// Call it after all known keys were taken. Error: names a key that was not.
  Status done();

 private:
  const toml::table& table_;
  std::string path_, where_;
  std::set<std::string, std::less<>> taken_;
  std::string error_;
};

}  // namespace telesplat::wall
