// Reads JSON files that programs of this project wrote, and that may hold anything by now.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "common/core/result.h"

namespace telesplat::tools {

inline constexpr uint64_t kMostJsonBytes = uint64_t{64} << 20;
inline constexpr int kDeepestJson = 64;  ///< nested objects and lists

/// Reads a file that holds one object. Values nested deeper than kDeepestJson are left out. Error: the file cannot be
/// read, is no regular file, has more than kMostJsonBytes, or is no JSON object.
Result<nlohmann::ordered_json> read_json_object(const std::string& path);

/// Leaves out values nested deeper than kDeepestJson. Returns a discarded value (is_discarded()) if the file cannot be
/// read, has more than kMostJsonBytes, or is no JSON.
nlohmann::ordered_json read_json_file(const std::string& path);

}  // namespace telesplat::tools
