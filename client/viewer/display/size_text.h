// Pairs of whole numbers as flags write them: "1280x800".
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "common/core/result.h"

namespace telesplat::viewer {

/// "AxB" with both in least..most; nothing: it is not.
std::optional<std::pair<int, int>> parse_pair(const std::string& text, int least, int most);

/// "WxH" with both in 16..16384. flag: named by the error.
Result<std::pair<int, int>> parse_size(const std::string& text, const char* flag);

}  // namespace telesplat::viewer
