// Reads pairs of whole numbers as flags have them: "1280x800".
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "common/core/result.h"

namespace telesplat::viewer {

/// Reads "AxB" with both in least..most; nothing: the text is not such a pair.
std::optional<std::pair<int, int>> parse_pair(const std::string& text, int least, int most);

/// Reads "WxH" with both in 16..16384. The error names `flag`.
Result<std::pair<int, int>> parse_size(const std::string& text, const char* flag);

}  // namespace telesplat::viewer
