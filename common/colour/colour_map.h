// Colour maps: a colour for each place between 0 and 1. Built-in ones by name, ParaView's JSON files, and a short text
// form for messages and records. docs/colour.md shows them.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::colour {

inline constexpr size_t kMaxStops = 200;     ///< stops of a map; files with more lose the least important
inline constexpr size_t kMaxMapName = 80;    ///< bytes
inline constexpr size_t kMaxMapText = 4000;  ///< bytes of the text form: it is sent in one string of a message

/// Colours are sRGB, 0xRRGGBB, and linear in their codes between stops; below the first stop and above the last, the
/// colour is that stop's. Two stops at one place make a jump; the last one holds there.
struct ColourMap {
  struct Stop {
    double x = 0;
    uint32_t rgb = 0;
    bool operator==(const Stop&) const = default;
  };
  std::string name;
  std::vector<Stop> stops;      ///< at least one; x ascends from 0 to 1
  uint32_t missing = 0xa0a0a0;  ///< colour of missing values (NaN)
  bool operator==(const ColourMap&) const = default;

  uint32_t at(double x) const;
};

/// Names of the built-in maps, in the order of display; the first is the default.
std::span<const std::string_view> colour_map_names();
/// Finds a built-in map; "_r" behind its name reverses it; case and hyphens do not count. Error: no such map; suggests
/// the nearest name and lists all.
Result<ColourMap> find_colour_map(std::string_view name);
/// Reads a user's text: a built-in name, FILE.json (the first map in it) or FILE.json:NAME. Errors name the file.
Result<ColourMap> resolve_colour_map(std::string_view text);

/// Writes only the name of a built-in map, "NAME=0:#440154,0.5:#21918c,1:#fde725/#a0a0a0" for any other; from_text
/// reads the same map from it.
std::string to_text(const ColourMap& map);
/// Error: another form, over kMaxMapText, or as validate().
Result<ColourMap> from_text(std::string_view text);

/// Refuses no stops, more than kMaxStops, stops that do not ascend within [0, 1], names that are too long or have
/// control characters.
Status validate(const ColourMap& map);

}  // namespace telesplat::colour
