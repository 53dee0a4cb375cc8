// JSON files that programs of this project wrote, and that may be anything by now.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "common/core/result.h"

namespace telesplat::tools {

inline constexpr uint64_t kMostJsonBytes = uint64_t{64} << 20;
inline constexpr int kDeepestJson = 64;  ///< objects and lists in each other

/// A file that holds one object. What is deeper than kDeepestJson is left out. Error: the file cannot be read, is no
/// regular file, has more than kMostJsonBytes, or is no JSON object.
Result<nlohmann::ordered_json> read_json_object(const std::string& path);

/// What is deeper than kDeepestJson is left out. Discarded (is_discarded()) where the file cannot be read, has more
/// than kMostJsonBytes, or is no JSON.
nlohmann::ordered_json read_json_file(const std::string& path);

}  // namespace telesplat::tools
