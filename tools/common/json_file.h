// JSON files that programs of this project wrote, and that may be anything by now.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace telesplat::tools {

inline constexpr uint64_t kMostJsonBytes = uint64_t{64} << 20;
inline constexpr int kDeepestJson = 64;  ///< objects and lists in each other

/// What is deeper than kDeepestJson is left out. Discarded (is_discarded()) where the file cannot be read, has more
/// than kMostJsonBytes, or is no JSON.
nlohmann::ordered_json read_json_file(const std::string& path);

}  // namespace telesplat::tools
