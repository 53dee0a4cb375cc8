// Inside services/data/cloud: the system of a cloud's coordinates, as LAS files tell it.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/placement.h"

namespace telesplat::data {

struct Reference {
  scene::Coordinates coordinates;  ///< shown: length of a unit in metres; for degrees, of z alone
  std::vector<std::string> notes;
};

/// Reads a reference system in Well-Known Text, version 1 or 2: its kind, name, code and units. nullopt: another text.
/// Source: OGC 12-063r5, 18-010r7.
std::optional<Reference> reference_of_wkt(std::string_view text);

/// Reads GeoTIFF keys (VLR 34735: numbers of 16 bits) and their texts (34737). Source: OGC 19-008r4. nullopt: they name
/// neither a projected nor a geographic system.
std::optional<Reference> reference_of_keys(std::span<const uint16_t> keys, std::string_view texts);

}  // namespace telesplat::data
