// The keys of one table of a wall's description: each is taken by whoever knows it, with its limits; what nobody takes
// is refused. Private to this library.
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
  /// The first error stays, and what is taken after it means nothing.
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
  /// A list of `least_count` or `most_count` numbers; of one, the number alone does.
  std::vector<double> list(const char* key, std::vector<double> fallback, size_t least_count, size_t most_count,
                           double least, double most);
  /// The table must have it.
  void require(const char* key);
  /// Refuses the table: "PATH:LINE: WHERE KEY: what".
  void refuse(const char* key, const std::string& what);
  /// To be called when all that are known were taken: names a key that was not.
  Status done();

 private:
  const toml::table& table_;
  std::string path_, where_;
  std::set<std::string, std::less<>> taken_;
  std::string error_;
};

}  // namespace telesplat::wall
